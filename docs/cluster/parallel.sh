#!/bin/sh
# A sweep in parts on one machine, or with GNU parallel on several: parallel.sh STUDY STORE PARTS OUTPUT
# xargs is everywhere; "parallel --sshlogin ..." takes the same words.
set -u
study=$1 store=$2 parts=$3 output=$4
taxel=${TAXEL:-taxel}
seq 0 $((parts - 1)) | xargs -P2 -I{} "$taxel" sweep "$study" --store "$store" --shard "{}/$parts" || exit
exec "$taxel" sweep "$study" --store "$store" --merge -o "$output"
