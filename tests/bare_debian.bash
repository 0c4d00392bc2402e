# A bare Debian in a folder, for tests/packages and tests/other_release, which source this file. Needs root.

# make_bare FOLDER RELEASE: what debootstrap installs, from its own mirror, and nothing else.
make_bare() {
    [ "$(id -u)" -eq 0 ] || { echo "error: needs root, for debootstrap and chroot" >&2; exit 1; }
    install_packages debootstrap
    [ -e "/usr/share/debootstrap/scripts/$2" ] || refuse "debootstrap knows no release $2"
    debootstrap --variant=minbase "$2" "$1" >"$1.log" 2>&1 || { tail -5 "$1.log" >&2; exit 1; }
    rm "$1.log"
}

# enter_bare FOLDER: gives it the devices, names of hosts and proxies of this machine; inside() then runs commands there.
enter_bare() {
    bare=$1
    mount -t proc proc "$bare/proc"
    mount -t sysfs -o ro sysfs "$bare/sys"
    mount --rbind /dev "$bare/dev"
    mount --make-rslave "$bare/dev"
    cp /etc/resolv.conf "$bare/etc/"
    apt-config dump | grep -iE '^Acquire::[a-z:]*Proxy' >"$bare/etc/apt/apt.conf.d/90proxy" || true
}

# inside COMMAND...
inside() {
    local proxies=() name
    for name in http_proxy https_proxy no_proxy; do [ -z "${!name:-}" ] || proxies+=("$name=${!name}"); done
    chroot "$bare" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
        "${proxies[@]}" "$@"
}

# leave_bare: undoes enter_bare.
leave_bare() {
    local place
    for place in proc sys dev; do
        if mountpoint -q "$bare/$place"; then umount -lR "$bare/$place"; fi
    done
}

step() { echo "== $* (after $((SECONDS / 60)):$(printf %02d $((SECONDS % 60))))"; }
