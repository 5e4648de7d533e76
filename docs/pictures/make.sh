#!/usr/bin/env bash
# Makes every picture of this folder again, from the program alone: pictures without a window by
# options of `glove-client run`, screens of the real window under Xvfb, with xdotool for the mouse.
#
#   docs/pictures/make.sh                           builds the client and makes all
#   BIN_DIR=target/release docs/pictures/make.sh    takes a client that is built already
#   docs/pictures/make.sh offscreen                 those without a window only
#   docs/pictures/make.sh window                    those of the window only
#   docs/pictures/make.sh operation                 of those, the operation example only
#   docs/pictures/make.sh colours                   of those, the colourings only
#
# Needs ImageMagick (montage, import), and for the window Xvfb and xdotool; all are in Debian.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

say() { printf 'pictures: %s\n' "$*"; }

WHAT=${1:-all}
PICTURES="$PWD/docs/pictures"
WORK=$(mktemp -d)
# shellcheck source=docs/pictures/window.sh
. docs/pictures/window.sh
end() {
    if [ "$?" != 0 ] && [ -n "$WINDOW_LOG" ]; then tail -n 20 "$WINDOW_LOG" >&2; fi
    close_window
    stop_display
    rm -rf "$WORK"
}
trap end EXIT

for tool in montage import Xvfb xdotool; do
    if ! command -v "$tool" > /dev/null; then
        say "there is no $tool; install imagemagick, xvfb and xdotool"
        exit 1
    fi
done
if [ -z "${BIN_DIR:-}" ]; then
    cargo build --release --locked --bin glove-client
    BIN_DIR="${CARGO_TARGET_DIR:-target}/release"
fi
BIN=$(cd "$BIN_DIR" && pwd)/glove-client
if [ -z "${XDG_RUNTIME_DIR:-}" ]; then
    mkdir -m 700 "$WORK/runtime"
    export XDG_RUNTIME_DIR="$WORK/runtime"
fi

# Without a window.
SIZE=960x640

# picture FILE ARGUMENTS…
picture() {
    local file=$1
    shift
    say "$file"
    "$BIN" run --headless --picture-size "$SIZE" --snapshot "$PICTURES/$file" "$@" \
        > "$WORK/run.out" 2> "$WORK/run.log" || { cat "$WORK/run.log" >&2; return 1; }
}

# Ticks at which a run of these arguments begins to deform and ends, into FROM and TO.
deforming_ticks() {
    "$BIN" run --headless "$@" > "$WORK/story" 2> "$WORK/run.log"
    FROM=$(awk '/entered Deforming/ { print $2; exit }' "$WORK/story")
    TO=$(awk '$1 == "ticks" { print $2 - 1 }' "$WORK/story")
}

# interaction FIGURE EYE OBJECT: not, little, more and most deformed, as figures a to d.
interaction() {
    local figure=$1 eye=$2 object=$3 letter share
    local story=(--object "$object" --hand scripted:squeeze)
    deforming_ticks "${story[@]}"
    for letter in a:0 b:25 c:50 d:100; do
        share=${letter#*:}
        picture "$figure${letter%:*}.png" "${story[@]}" --eye "$eye" \
            --at $((FROM + (TO - FROM) * share / 100))
    done
}

offscreen() {
    local eye=-120,14,0.40
    # Figure 3.5: attached, deformed a little, deformed much.
    local squeeze=(--hand scripted:squeeze)
    deforming_ticks "${squeeze[@]}"
    picture figure-3.5a.png "${squeeze[@]}" --eye "$eye" --at attached
    picture figure-3.5b.png "${squeeze[@]}" --eye "$eye" --at $((FROM + (TO - FROM) / 4))
    picture figure-3.5c.png "${squeeze[@]}" --eye "$eye" --at deforming

    # Figure 4.13: the sphere tree of the strawberry, level by level.
    local level levels=()
    for level in 0 1 2 3 4 5; do
        SIZE=480x420 picture "level-$level.png" --hand scripted:approach --frames 1 --at 0 \
            --show "spheres:$level" --eye -43,15,0.27
        mv "$PICTURES/level-$level.png" "$WORK"
        levels+=(-label "level $level" "$WORK/level-$level.png")
    done
    montage -font DejaVu-Sans -pointsize 18 "${levels[@]}" -tile 3x2 -geometry +4+4 \
        "$PICTURES/figure-4.13.png"

    # Figure 4.21: what the search for the index finger looks at.
    picture figure-4.21.png --hand scripted:squeeze --at avoiding --show search,colliders \
        --eye -75,14,0.40

    # Figures 4.24 to 4.29: squeezed, kept, squeezed again from another side.
    picture figure-4.24.png --hand scripted:regrasp --at deforming --eye "$eye"
    picture figure-4.25.png --hand scripted:regrasp --at detached --eye "$eye"
    picture figure-4.26.png --hand scripted:regrasp --at free:2 --eye "$eye"
    picture figure-4.27.png --hand scripted:regrasp --at attached:2 --eye "$eye"
    picture figure-4.28.png --hand scripted:regrasp --at deforming:2 --eye "$eye"
    picture figure-4.29.png --hand scripted:regrasp --at detached:2 --eye "$eye"

    # Figures 6.2 to 6.5.
    interaction figure-6.2 -30,25,0.38 cube
    interaction figure-6.3 30,15,0.38 sphere
    interaction figure-6.4 "$eye" strawberry
    interaction figure-6.5 -150,20,0.42 toothpaste

    # The elements, and the shape at rest as a ghost.
    picture elements.png "${squeeze[@]}" --at deforming --show hand,elements --eye "$eye"
    picture rest-shape.png "${squeeze[@]}" --at deforming --show rest,contacts,forces --eye "$eye"

    # The first thing that a reader sees.
    picture grasp.png "${squeeze[@]}" --at deforming --eye "$eye" --show hand
    say lift.gif
    # By the eye and in the colours that the window directs.
    "$BIN" run --headless --light fair --show hand --picture-size 420x280 \
        --animation "$PICTURES/lift.gif" > "$WORK/run.out" 2> "$WORK/run.log"
    say grasp.gif
    "$BIN" run --headless --hand scripted:release --light fair --picture-size 420x280 \
        --animation "$PICTURES/grasp.gif" > "$WORK/run.out" 2> "$WORK/run.log"
}

# Of the window.

# menu ENTRY NEXT [FILE]: opens the pop-up menu, makes the picture FILE of it, and chooses ENTRY,
# after which NEXT looks otherwise.
menu() {
    local entry=$1 next=$2 file=${3:-}
    shows "$entry" click_at 3 300 240
    shows "$entry" point "$entry"
    if [ -n "$file" ]; then screen "$file"; fi
    shows "$next" click "$entry"
}

# The operation example of thesis 6.3, with the mouse alone.
operation_example() {
    say "the operation example"
    mkdir -p "$WORK/desk"
    "$BIN" mesh toothpaste --nodes 1000 --out "$WORK/desk/toothpaste.msh" > "$WORK/run.out"
    open_window --hand mouse --grasp thesis --eye -12,26,0.46
    sleep 2
    menu "Read file …" "file name" figure-6.1.png
    shows "file name" click toothpaste.msh
    screen figure-6.7.png
    click Read
    await_news 120 "the object is now toothpaste.msh"
    sleep 2
    screen figure-6.6.png
    click Reach
    sleep 6
    screen figure-6.8.png
    # Three fingertips attach; thumb and little finger stay away.
    local finger
    for finger in index middle ring; do
        shows "$finger" slide "$finger" 3 40
    done
    await_news 60 "entered Attached"
    sleep 3
    screen figure-6.9.png
    for finger in thumb little; do
        shows "$finger" slide "$finger" 3 40
    done
    shows "close all" slide "close all" 40 85
    await_news 60 "entered Deforming"
    sleep 8
    screen figure-6.10.png
    sleep 3
    menu "Keep shape" "Keep shape"
    await_news 40 "shape kept"
    sleep 3
    screen figure-6.10-kept.png
    menu "Save as …" "file name" figure-6.11.png
    screen figure-6.12.png
    click Save
    await_news 20 "saved .*"
    click "Other side"
    # The hand looks for another way to grasp, and goes there.
    sleep 25
    screen figure-6.13.png
    close_window
}

# shading_screen FILE SHADING: a squeezed tube in colours, with its legend, from the side of
# the fingertips, without the hand.
shading_screen() {
    say "$1"
    open_window --object toothpaste --hand scripted:squeeze --shading "$2" --show forces \
        --eye -150,25,0.40
    await_news 60 "entered Deforming"
    # In the middle of the squeeze; however slowly the pictures are drawn, it stands still from here on.
    sleep 4
    xdotool key Return
    screen "$1"
    close_window
}

colours() {
    local shading
    for shading in displacement strain von-mises error; do
        shading_screen "shading-$shading.png" "$shading"
    done
}

window() {
    start_display
    operation_example
    colours
    stop_display
}

case $WHAT in
    all) offscreen; window ;;
    offscreen) offscreen ;;
    window) window ;;
    operation) start_display; operation_example ;;
    colours) start_display; colours ;;
    *) say "'$WHAT' is not offscreen, window, operation, colours or all"; exit 2 ;;
esac

# Fewer colours make smaller files where pngquant is there.
if command -v pngquant > /dev/null; then
    pngquant --quality 85-98 --skip-if-larger --force --ext .png "$PICTURES"/*.png || true
fi
say "$(du -sh "$PICTURES" | cut -f1) in docs/pictures"
