# The headers that modules of Python are compiled with, for apps/package, which sources this file.

# fetch_packages FOLDER RELEASE PACKAGE...: unpacks packages of a release of Debian into a folder, without installing them.
fetch_packages() {
    local folder=$1 release=$2 package
    shift 2
    mkdir -p "$folder/apt/lists/partial" "$folder/apt/cache/archives/partial" "$folder/apt/none"
    echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] http://deb.debian.org/debian $release main" \
        >"$folder/apt/sources.list"
    local options=(-qq -o Dir::Etc::SourceList="$folder/apt/sources.list" -o Dir::Etc::SourceParts="$folder/apt/none"
        -o Dir::Etc::PreferencesParts="$folder/apt/none" -o Dir::Etc::Preferences=/dev/null -o Dir::State::Lists="$folder/apt/lists" -o Dir::Cache="$folder/apt/cache"
        -o Acquire::Languages=none -o APT::Sandbox::User= -o APT::Default-Release=)
    apt-get "${options[@]}" update
    (cd "$folder/apt" && apt-get "${options[@]}" download "$@")
    for package in "$folder"/apt/*.deb; do dpkg-deb -x "$package" "$folder"; done
    rm -r "$folder/apt"
}

# python_headers FOLDER [PYTHON...]: the headers of pybind11 of Debian 13, which knows numpy 2, in FOLDER/pybind11; those of
# Python 3.11 and 3.13, from Debian 12 and 13, and of further interpreters, in FOLDER/python3.*. Keeps what is there.
python_headers() {
    local folder=$1 python release minor new=$1.new
    shift
    if [ ! -e "$folder/complete" ]; then
        rm -rf "$folder" "$new"
        mkdir -p "$folder"
        for release in bookworm:11 trixie:13; do
            minor=${release#*:}
            local packages=("libpython3.$minor-dev")
            [ "$minor" = 11 ] || packages+=(pybind11-dev)
            echo "headers of Python 3.$minor from Debian's ${release%:*}"
            fetch_packages "$new/$minor" "${release%:*}" "${packages[@]}"
            cp -r "$new/$minor/usr/include/python3.$minor" "$folder/"
            cp "$new/$minor/usr/include/$(uname -m)-linux-gnu/python3.$minor/pyconfig.h" "$folder/python3.$minor/"
        done
        cp -r "$new/13/usr/include/pybind11" "$folder/"
        cp "$new/13/usr/share/doc/pybind11-dev/copyright" "$folder/pybind11/"
        rm -r "$new"
        touch "$folder/complete"
    fi
    for python in "$@"; do
        local include
        include=$("$python" -c 'import sysconfig; print(sysconfig.get_path("include"))')
        [ -e "$include/Python.h" ] || { echo "error: $python: has no headers, $include/Python.h" >&2; return 1; }
        rm -rf "${folder:?}/${include##*/}"
        cp -r "$include" "$folder/"
    done
}
