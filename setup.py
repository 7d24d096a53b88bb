# SPDX-License-Identifier: Apache-2.0
"""Install comply_ros where ROS 2 looks for it."""

from glob import glob
from runpy import run_path

from setuptools import find_packages, setup

# Read without importing the package, which needs not be importable where it is built.
EXECUTABLES = run_path('comply_ros/executables.py')['EXECUTABLES']

setup(
    name='comply_ros',
    version='0.1.0',
    packages=find_packages(include=('comply_ros', 'comply_ros.*')),
    package_data={'comply_ros': ['maps/*.yaml', 'py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/comply_ros']),
        ('share/comply_ros', ['package.xml']),
        ('share/comply_ros/launch', glob('launch/*.launch.py')),
        ('share/comply_ros/config', glob('config/*.yaml') + glob('config/*.json')),
        ('share/comply_ros/rviz', glob('rviz/*.rviz')),
        ('share/comply_ros/config/security', glob('config/security/*.policy.xml')),
    ],
    python_requires='>=3.11',
    zip_safe=True,
    license='Apache-2.0',
    description='A robot learns a task from a mentor that may be wrong, and how far to comply.',
    maintainer='The comply_ros maintainers',
    maintainer_email='maintainers@comply-ros.example',
    entry_points={'console_scripts': [
        f'{name} = comply_ros.executables:{name}' for name in EXECUTABLES]},
)
