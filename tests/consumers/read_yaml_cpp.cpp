// Lens and lasers of a calibration by yaml-cpp, one number a line.
#include <iomanip>
#include <iostream>
#include <yaml-cpp/yaml.h>

int main(int, char **argv)
{
    YAML::Node file = YAML::LoadFile(argv[1]), ranger = file["laser_ranger"];
    std::cout << std::setprecision(17) << file["image_width"].as<int>() << '\n' << file["image_height"].as<int>() << '\n';
    for (const char *matrix : {"camera_matrix", "distortion_coefficients"})
        for (const auto &value : file[matrix]["data"])
            std::cout << value.as<double>() << '\n';
    std::cout << ranger["reference_plane"]["offset_mm"].as<double>() << '\n';
    for (const auto &laser : ranger["lasers"])
        for (const char *part : {"origin_mm", "direction"})
            for (const auto &value : laser[part])
                std::cout << value.as<double>() << '\n';
    const YAML::Node covariance = ranger["parameters"]["covariance"];
    const int size = covariance["rows"].as<int>();
    double trace = 0;
    for (int i = 0; i < size; i++)
        trace += covariance["data"][i * size + i].as<double>();
    std::cout << trace << '\n';
}
