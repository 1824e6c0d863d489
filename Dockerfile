# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
# The node in a container: docker build -t kinematics_service . &&
# docker run --net host --ipc host kinematics_service --robot ur5e
FROM ros:jazzy-ros-base AS wheel
SHELL ["/bin/bash", "-o", "pipefail", "-c"]
# hadolint ignore=DL3008
RUN apt-get update && apt-get install -y --no-install-recommends \
    gcc python3-dev python3-venv && rm -rf /var/lib/apt/lists/*
COPY . /source
RUN python3 -m venv /build && /build/bin/pip wheel --no-cache-dir --no-deps --wheel-dir /wheel /source

FROM ros:jazzy-ros-base
# hadolint ignore=DL3008
RUN apt-get update && apt-get install -y --no-install-recommends \
    python3-numpy python3-rich python3-sympy python3-typer python3-yaml python3-pip && \
    rm -rf /var/lib/apt/lists/*
COPY --from=wheel /wheel /wheel
# The libraries are those of Ubuntu, which ROS uses, too.
RUN python3 -m pip install --no-cache-dir --no-deps --break-system-packages /wheel/*.whl && \
    useradd --create-home --uid 10001 robot
USER 10001
ENTRYPOINT ["/ros_entrypoint.sh", "python3", "-m", "kinematics_service"]
