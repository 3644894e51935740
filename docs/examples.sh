#!/usr/bin/env bash
# Writes docs/book/examples.md and its pictures: runs each example and puts its
# text, what it prints and what it draws onto the page. A test compares the
# page with the examples.
set -euo pipefail
cd "$(dirname "$0")/.."
page=docs/book/examples.md
out=$(mktemp)
trap 'rm -f "$out"' EXIT
cat >"$out" <<'TXT'
# Examples

Short programs over the library, each in `crates/*/examples`; the command before each runs
it from a checkout. Each prints its results and, given a file name, draws its picture.
This page is written by `docs/examples.sh`.
TXT
for file in $(printf '%s\n' crates/*/examples/ex0*.rs | sort -t/ -k4); do
    name=$(basename "$file" .rs)
    crate=$(echo "$file" | cut -d/ -f2)
    title=$(sed -n '1s/^\/\/! //p' "$file" | sed 's/[.:]$//')
    echo "$name" >&2
    printed=$(cargo run --quiet --locked -p "$crate" --example "$name" -- "docs/images/$name.svg")
    {
        printf '\n## %s\n\n`cargo run -p %s --example %s`\n\n' "$title" "$crate" "$name"
        printf '```rust\n'
        cat "$file"
        printf '```\n\nIt prints\n\n```text\n%s\n```\n\n![%s](../images/%s.svg)\n' "$printed" "$title" "$name"
    } >>"$out"
done
mv "$out" "$page"
chmod 644 "$page"
trap - EXIT
