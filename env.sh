# The bench's environment for this shell, from any directory:  source env.sh   (bash or zsh)
# Activates the virtual environment and the workspace's overlay, like any ROS 2 setup.bash. Sourcing it again is
# harmless.

_hsv_env() {
    local shell="$1" root route sourced=wheels nounset=""
    root="$(cd "$(dirname "$2")" >/dev/null && pwd -P)" || return 1
    if [ "${HSV_ROOT:-$root}" != "$root" ]; then
        echo "env.sh: this shell already uses the checkout in $HSV_ROOT; open a new one" >&2
        return 1
    fi
    if [ ! -f "$root/.venv/hsv-setup" ] || [ ! -f "$root/ros_ws/install/local_setup.$shell" ]; then
        echo "env.sh: not set up yet, run this first: make -C '$root' setup" >&2
        return 1
    fi
    read -r route _ < "$root/.venv/hsv-setup"
    # An official ROS image sets ROS_DISTRO in every terminal, also where no installation is sourced.
    [ -z "${AMENT_PREFIX_PATH:-}" ] || sourced="${ROS_DISTRO:-wheels}"
    if [ -z "${HSV_ROOT:-}" ] && [ "$route" != "$sourced" ]; then
        echo "env.sh: set up for ROS from $route, this shell has $sourced: source that, or make setup again" >&2
        return 1
    fi

    # Neither venv nor colcon write their scripts for "set -u".
    case $- in *u*) nounset=yes && set +u ;; esac
    case ":$PATH:" in
        *":$root/.venv/bin:"*) ;;
        *) . "$root/.venv/bin/activate" ;;
    esac
    case ":${AMENT_PREFIX_PATH:-}:" in
        *":$root/.venv:"*) ;;
        *)
            if [ "$route" = wheels ]; then
                # The virtual environment is the ament prefix under the overlay.
                export AMENT_PREFIX_PATH="${AMENT_PREFIX_PATH:+$AMENT_PREFIX_PATH:}$root/.venv"
                export CMAKE_PREFIX_PATH="${CMAKE_PREFIX_PATH:+$CMAKE_PREFIX_PATH:}$root/.venv"
            fi ;;
    esac
    # Left over from a Python process that started this shell, it would keep the next one from finding its libraries.
    unset _ROS_WHEELS_BOOTSTRAP_COMPLETE
    . "$root/ros_ws/install/local_setup.$shell"
    [ -z "$nounset" ] || set -u

    export HSV_ROOT="$root"
    export HSV_DESIGN_PATH="${HSV_DESIGN_PATH:-$root/offline_design}"
    export ROS_AUTOMATIC_DISCOVERY_RANGE="${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}"
    # Small matrices: more threads would only wait for each other, and change last bits.
    export OPENBLAS_NUM_THREADS="${OPENBLAS_NUM_THREADS:-1}"
    # ROS nodes do not start without a place for their log files.
    [ -n "${HOME:-}${ROS_HOME:-}${ROS_LOG_DIR:-}" ] || export ROS_LOG_DIR="$root/ros_ws/log/nodes"

    # In an interactive shell, the words of the hsv command are completed as typer does it.
    case "$-$shell" in
        *i*bash)
            # Quoted, because other shells could not even read it.
            eval '_hsv_completion() {
                COMPREPLY=($(COMP_WORDS="${COMP_WORDS[*]}" COMP_CWORD=$COMP_CWORD _HSV_COMPLETE=complete_bash hsv))
            }'
            complete -o default -F _hsv_completion hsv ;;
        *i*zsh)
            whence compdef >/dev/null || { autoload -Uz compinit && compinit; }
            _hsv_completion() { eval "$(_TYPER_COMPLETE_ARGS="${words[1,$CURRENT]}" _HSV_COMPLETE=complete_zsh hsv)"; }
            compdef _hsv_completion hsv ;;
    esac
}

if [ -n "${BASH_VERSION:-}" ]; then
    _hsv_env bash "${BASH_SOURCE[0]}"
elif [ -n "${ZSH_VERSION:-}" ]; then
    eval '_hsv_env zsh "${(%):-%x}"'
else
    echo "env.sh: source it from bash or zsh" >&2
    false
fi
# The status is handed on without leaving a variable behind.
_hsv_status=$?
unset -f _hsv_env
eval "unset _hsv_status; (exit $_hsv_status)"
