// Lens and lasers of a calibration by OpenCV's FileStorage, one number a line.
#include <iomanip>
#include <iostream>
#include <opencv2/core.hpp>

int main(int, char **argv)
{
    cv::FileStorage file(argv[1], cv::FileStorage::READ);
    cv::Mat camera, distortion;
    file["camera_matrix"] >> camera;
    file["distortion_coefficients"] >> distortion;
    std::cout << std::setprecision(17) << (int)file["image_width"] << '\n' << (int)file["image_height"] << '\n';
    for (double value : cv::Mat_<double>(camera))
        std::cout << value << '\n';
    for (double value : cv::Mat_<double>(distortion))
        std::cout << value << '\n';
    cv::FileNode ranger = file["laser_ranger"];
    std::cout << (double)ranger["reference_plane"]["offset_mm"] << '\n';
    for (const auto &laser : ranger["lasers"])
        for (const char *part : {"origin_mm", "direction"})
            for (const auto &value : laser[part])
                std::cout << (double)value << '\n';
    cv::Mat covariance;
    ranger["parameters"]["covariance"] >> covariance;
    std::cout << cv::trace(covariance)[0] << '\n';
}
