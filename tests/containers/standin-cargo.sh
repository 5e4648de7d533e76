#!/bin/sh
# Stands for cargo in the build stage where no image with Rust can be had: accepts exactly the
# command of the Dockerfile and lays out binaries that were built outside.
set -eu
expected='build --release --locked --bins --package fea-server --package glove-client --no-default-features --features fea-server/otlp,glove-client/otlp'
if [ "$*" != "$expected" ]; then
    echo "stand-in cargo: called with '$*', expected '$expected'" >&2
    exit 1
fi
for file in Cargo.toml Cargo.lock crates/fea-server/Cargo.toml crates/glove-client/Cargo.toml; do
    [ -f "$file" ] || { echo "stand-in cargo: $file did not come with the context" >&2; exit 1; }
done
mkdir -p target/release
cp /prebuilt/fea-server /prebuilt/glove-client target/release/
