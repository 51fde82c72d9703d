#!/bin/sh
# Copies the program, what it links to and what it reads into two root folders, with nothing else
# in them: /core for every service, where processors draw; /full with Vulkan as well, for GPUs.
set -eu

# copy ROOT FILE: the file with its links, at the same path below ROOT.
copy() {
    target=$(readlink -f "$2")
    mkdir -p "$1$(dirname "$2")" "$1$(dirname "$target")"
    cp -pu "$target" "$1$target"
    [ "$target" = "$2" ] || [ -e "$1$2" ] || ln -s "$target" "$1$2"
}

# closure ROOT FILE...: the files and every library that they link to.
closure() {
    root=$1
    shift
    for file in "$@"; do
        copy "$root" "$file"
        ldd "$file" | grep -oE '/[^ ]+' | while read -r library; do copy "$root" "$library"; done
    done
}

for root in /core /full; do
    closure "$root" /usr/bin/causeway
    # Whoever resolves names of other machines loads these by name.
    closure "$root" /lib/"$(uname -m)"-linux-gnu/libnss_dns.so.2 \
        /lib/"$(uname -m)"-linux-gnu/libnss_files.so.2
    # Recordings are kept by a volume there; whoever runs the container may write them.
    mkdir -p "$root/tmp" "$root/recordings" "$root/etc"
    chown 10001:10001 "$root/recordings"
    chmod 1777 "$root/tmp" "$root/recordings"
    echo 'causeway:x:10001:10001::/tmp:/nonexistent' >"$root/etc/passwd"
    echo 'causeway:x:10001:' >"$root/etc/group"
    echo 'hosts: files dns' >"$root/etc/nsswitch.conf"
done

# Vulkan's loader, and what a GPU's driver, which is mounted into the container, links to.
closure /full /usr/lib/"$(uname -m)"-linux-gnu/libvulkan.so.1 \
    /usr/lib/"$(uname -m)"-linux-gnu/libX11.so.6 /usr/lib/"$(uname -m)"-linux-gnu/libXext.so.6
