"""Package of the node for colcon."""

from setuptools import setup

setup(
    name="laser_range_node",
    version="0.1.0",
    packages=["laser_range_node"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/laser_range_node"]),
        ("share/laser_range_node", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    entry_points={"console_scripts": ["laser_range = laser_range_node.node:main"]},
)
