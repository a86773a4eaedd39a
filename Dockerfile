# The bench on a full ROS 2 Jazzy (Ubuntu 24.04, Python 3.12):
#   docker build --tag hsv-bench .
#   docker run --rm --shm-size 512m hsv-bench hsv run case1

# What "make setup" needs of the system; the development container builds this stage alone.
FROM ros:jazzy-ros-base AS system
RUN apt-get update \
    && apt-get install --yes --no-install-recommends cmake g++ git make python3-dev python3-venv \
    && rm -rf /var/lib/apt/lists/*

FROM system AS bench
RUN install --directory --owner ubuntu --group ubuntu /hsv-bench
USER ubuntu
WORKDIR /hsv-bench
COPY --chown=ubuntu:ubuntu . .
SHELL ["/bin/bash", "-c"]
RUN source /opt/ros/jazzy/setup.bash && make setup
ENTRYPOINT ["/bin/bash", "-c", "source /opt/ros/jazzy/setup.bash && source ./env.sh && exec \"$@\"", "bash"]
CMD ["bash"]
