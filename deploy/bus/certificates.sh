#!/bin/sh
# certificates.sh DIR ROLE=HOST[,HOST...]...: keys and certificates of a bus with TLS, in DIR.
#
# The first call makes the authority that signs, DIR/ca.crt and DIR/ca.key; keep the key apart from
# the services. ROLE is the common name and the name of the files: causeway-router, causeway-world,
# causeway-render, causeway-face, or tenant-NAME for who only watches. HOSTs are the names and IP
# addresses by which others connect, which only routers need: causeway-router=router-0,10.0.3.7
# CAUSEWAY_CERTIFICATE_DAYS (30) says how long they are good.
set -eu
if [ $# -lt 2 ]; then
    sed -n '2,9s/^# \{0,1\}//p' "$0"
    exit 2
fi
dir=$1
shift
days=${CAUSEWAY_CERTIFICATE_DAYS:-30}
mkdir -p "$dir"
umask 077
key() {
    openssl genpkey -quiet -algorithm EC -pkeyopt ec_paramgen_curve:P-256 -out "$1" 2>/dev/null ||
        openssl ecparam -name prime256v1 -genkey -noout -out "$1"
}
if [ ! -e "$dir/ca.key" ]; then
    key "$dir/ca.key"
    openssl req -x509 -new -key "$dir/ca.key" -sha256 -days 3650 -subj "/CN=Causeway bus" \
        -addext basicConstraints=critical,CA:TRUE -addext keyUsage=critical,keyCertSign -out "$dir/ca.crt"
fi
for wanted; do
    role=${wanted%%=*}
    names=DNS:$role
    if [ "$role" != "$wanted" ]; then
        for host in $(echo "${wanted#*=}" | tr , ' '); do
            case $host in
            *[!0-9.]*) names=$names,DNS:$host ;;
            *) names=$names,IP:$host ;;
            esac
        done
    fi
    key "$dir/$role.key"
    openssl req -new -key "$dir/$role.key" -subj "/CN=$role" -out "$dir/$role.csr"
    printf 'subjectAltName=%s\nextendedKeyUsage=serverAuth,clientAuth\nbasicConstraints=CA:FALSE\n' "$names" |
        openssl x509 -req -in "$dir/$role.csr" -CA "$dir/ca.crt" -CAkey "$dir/ca.key" -CAcreateserial \
            -sha256 -days "$days" -extfile /dev/stdin -out "$dir/$role.crt" 2>/dev/null
    rm "$dir/$role.csr"
    echo "$dir/$role.crt"
done
chmod a+r "$dir"/*.crt
