#!/bin/sh
# Copies the program, what it links to and what it reads into two root folders, with nothing else
# in them: /core for every service, where processors draw; /full with Vulkan as well, for GPUs and
# with Mesa's software.
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
    mkdir -p "$root/tmp" "$root/etc"
    chmod 1777 "$root/tmp"
    echo 'causeway:x:10001:10001::/tmp:/nonexistent' >"$root/etc/passwd"
    echo 'causeway:x:10001:' >"$root/etc/group"
    echo 'hosts: files dns' >"$root/etc/nsswitch.conf"
done

icd=$(ls /usr/share/vulkan/icd.d/lvp_icd.*.json)
copy /full "$icd"
driver=$(sed -n 's/.*"library_path": *"\([^"]*\)".*/\1/p' "$icd")
case "$driver" in /*) ;; *) driver=/usr/lib/$(uname -m)-linux-gnu/$driver ;; esac
closure /full "$driver" /usr/lib/"$(uname -m)"-linux-gnu/libvulkan.so.1
# What a GPU's driver, which is mounted into the container, links to.
closure /full /usr/lib/"$(uname -m)"-linux-gnu/libX11.so.6 /usr/lib/"$(uname -m)"-linux-gnu/libXext.so.6
