# What the scripts of this project share. A script sets `script` to its own path, goes to the project's folder and sources
# this file.

# Prints what the script does: the comment at its head.
usage() { sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$script"; }

# answer_help ARGUMENTS...: where --help is among them, prints what the script does and ends it.
answer_help() {
    local argument
    for argument in "$@"; do
        case $argument in --help | -h) usage; exit 0 ;; esac
    done
}

# refuse MESSAGE: ends the script because it was called wrongly.
refuse() {
    echo "${script##*/}: error: $1; see ${script#"$PWD/"} --help" >&2
    exit 2
}

# refuse_options ARGUMENTS...: where one of them is an option, ends the script.
refuse_options() {
    local argument
    for argument in "$@"; do
        case $argument in -*) refuse "unknown option $argument" ;; esac
    done
}

# refuse_arguments ARGUMENTS...: ends the script if there are any.
refuse_arguments() {
    refuse_options "$@"
    [ $# -eq 0 ] || refuse "takes no argument; given: $1"
}

is_installed() { [ "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null)" = installed ]; }

# install_packages PACKAGE...: installs the Debian packages that are missing, as root or by sudo.
install_packages() {
    local package missing=() as_root=()
    for package in "$@"; do
        is_installed "$package" || missing+=("$package")
    done
    [ "${#missing[@]}" -gt 0 ] || return 0
    echo "installing: ${missing[*]}"
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || { echo "error: need root or sudo to install: ${missing[*]}" >&2; exit 1; }
        as_root=(sudo)
    fi
    "${as_root[@]}" apt-get update -qq
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
}

# Whether this release of Debian has a package. Asks the lists of the last `apt-get update`.
has_package() { is_installed "$1" || [ -n "$(apt-cache show "$1" 2>/dev/null)" ]; }
