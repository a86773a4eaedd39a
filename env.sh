# The bench's environment for this shell, from any directory:  source env.sh   (bash or zsh)
# Activates the virtual environment and the workspace's overlay, like any ROS 2 setup.bash. Sourcing it again is
# harmless.

_hsv_env() {
    local file shell nounset=""
    if [ -n "${BASH_VERSION:-}" ]; then
        shell=bash file="${BASH_SOURCE[0]}"
    elif [ -n "${ZSH_VERSION:-}" ]; then
        shell=zsh file="$1"
    else
        echo "env.sh: source it from bash or zsh" >&2
        return 1
    fi
    local root
    root="$(cd "$(dirname "$file")" >/dev/null && pwd -P)" || return 1

    if [ "${HSV_ROOT:-$root}" != "$root" ]; then
        echo "env.sh: this shell already uses the checkout in $HSV_ROOT; open a new one" >&2
        return 1
    fi
    if [ ! -f "$root/.venv/hsv-setup/environment" ] || [ ! -f "$root/ros_ws/install/local_setup.$shell" ]; then
        echo "env.sh: not set up yet, run this first: make -C '$root' setup" >&2
        return 1
    fi
    local route
    route="$(cat "$root/.venv/hsv-setup/route")"
    if [ "$route" = jazzy ] && [ "${ROS_DISTRO:-}" != jazzy ]; then
        echo "env.sh: set up for an installed ROS 2 Jazzy: source its setup.$shell first" >&2
        return 1
    fi
    if [ "$route" = wheels ] && [ -n "${ROS_DISTRO:-}" ]; then
        echo "env.sh: ROS 2 $ROS_DISTRO is sourced, but the bench was set up with its own ROS: use a new shell, or make setup again" >&2
        return 1
    fi

    # Neither venv nor colcon write their scripts for "set -u".
    case $- in *u*) nounset=yes && set +u ;; esac
    case ":$PATH:" in
        *":$root/.venv/bin:"*) ;;
        *) . "$root/.venv/bin/activate" ;;
    esac
    if [ "$route" = wheels ]; then
        # The virtual environment is the ament prefix under the overlay.
        _hsv_append AMENT_PREFIX_PATH "$root/.venv"
        _hsv_append CMAKE_PREFIX_PATH "$root/.venv"
    fi
    # Left over from a Python process that started this shell, it would keep the next one from finding its libraries.
    unset _ROS_WHEELS_BOOTSTRAP_COMPLETE
    . "$root/ros_ws/install/local_setup.$shell"
    [ -z "$nounset" ] || set -u

    # Words are completed where somebody types them; zsh needs its own completion started for that.
    case $- in
        *i*) [ ! -f "$root/.venv/hsv-setup/completion.$shell" ] || _hsv_completion_of "$root/.venv/hsv-setup" ;;
    esac

    export HSV_ROOT="$root"
    export HSV_DESIGN_PATH="${HSV_DESIGN_PATH:-$root/offline_design}"
    export ROS_AUTOMATIC_DISCOVERY_RANGE="${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}"
    # Small matrices: more threads would only wait for each other, and change last bits.
    export OPENBLAS_NUM_THREADS="${OPENBLAS_NUM_THREADS:-1}"
    if [ -z "${HOME:-}${ROS_HOME:-}${ROS_LOG_DIR:-}" ]; then
        # ROS nodes do not start without a place for their log files.
        export ROS_LOG_DIR="$root/ros_ws/log/nodes"
    fi
}

# Reads what the command line library completes the words of the hsv command by.
_hsv_completion_of() {
    if [ -n "${ZSH_VERSION:-}" ]; then
        whence compdef >/dev/null || { autoload -Uz compinit && compinit; }
    fi
    . "$1/completion.$shell"
}

# Appends a directory to a search path that does not hold it yet.
_hsv_append() {
    local value
    eval "value=\${$1:-}"
    case ":$value:" in
        *":$2:"*) ;;
        *) export "$1=${value:+$value:}$2" ;;
    esac
}

if [ -n "${ZSH_VERSION:-}" ]; then
    eval '_hsv_env "${(%):-%x}"'
else
    _hsv_env
fi
_hsv_status=$?
unset -f _hsv_env _hsv_append _hsv_completion_of
# The status is handed on without leaving a variable behind.
eval "unset _hsv_status; (exit $_hsv_status)"
