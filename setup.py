# SPDX-License-Identifier: Apache-2.0
"""Install comply_ros where ROS 2 looks for it."""

from glob import glob

from setuptools import find_packages, setup

EXECUTABLES = ('grid_world', 'mentor', 'learner', 'teleop_mentor', 'fault_injector', 'viewer',
               'lesson', 'dashboard', 'train', 'reproduce', 'sweep', 'topic', 'service',
               'param', 'record', 'replay', 'plot')

setup(
    name='comply_ros',
    version='0.1.0',
    packages=find_packages(include=('comply_ros', 'comply_ros.*'),
                           exclude=('comply_ros.benchmarks',)),
    package_data={'comply_ros': ['maps/*.yaml']},
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
    description='A robot learns from a suboptimal teacher, and how far to comply, over topics.',
    maintainer='The comply_ros maintainers',
    maintainer_email='maintainers@comply-ros.example',
    entry_points={'console_scripts': [
        f'{name} = comply_ros.entry:{name}' for name in EXECUTABLES]},
)
