#!/usr/bin/env bash
# A curious newcomer: presses every key and every entry of every menu, in every state of the story and
# of the hand, in windows of three sizes; then waits for the story to begin anew, takes the hand, and
# looks what it costs. Ends as tests/window/run.sh does.
#
#   BIN_DIR=target/debug tests/window/newcomer.sh [FOLDER]     keeps a picture of each state in FOLDER
#   SIZES="800x600 1280x800" …                                 windows of these sizes only
set -euo pipefail
pictures="${1:+$(mkdir -p "$1" && cd "$1" && pwd)}"
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/window/driving.sh
source tests/window/driving.sh

# seen NAME: a picture of the window, where pictures are kept.
seen() {
    [ -n "$pictures" ] && command -v import >/dev/null || return 0
    import -window root -crop "$size+0+0" +repage "$pictures/$size-$1.png"
}

# Every key that does something, each as often as it takes to come back to where it began.
keys=(c c c c c w w g g h h l l o o n n t t shift+t shift+t F1 Escape F2 F2 F3 F3 F4 F4 period Return
    k ctrl+z BackSpace Home Tab p ctrl+o Escape ctrl+s Escape)

# press_all: every key, one after the other.
press_all() {
    local key
    for key in "${keys[@]}"; do
        xdotool key "$key" sleep 0.06
        alive
    done
    settle
    no_panic
}

# Entries of the menus, but for those that leave (what they lead to is tried elsewhere) and for the
# hand, whose name is that of a menu too (its key is pressed).
entries=(
    "Object:Cube" "Object:Strawberry"
    "Solve:condensed" "Solve:front" "Solve:pcg" "Solve:1 %" "Solve:0.0001 %" "Solve:rounding only" "Solve:auto"
    "View:Displacement" "View:Largest principal strain" "View:Von Mises stress"
    "View:Estimated stress error" "View:Plain"
    "View:show Elements" "View:show Elements" "View:show Shape at rest" "View:show Shape at rest"
    "View:show Colliders" "View:show Colliders" "View:show Contacts" "View:show Contacts" "View:show Forces" "View:show Forces"
    "View:Next level of the sphere tree" "View:Last level of the sphere tree"
    "View:Fair light" "View:Full light" "View:Plain light" "View:Frame the scene"
    "Help:Help" "Help:Help" "Help:Information" "Help:Information" "Help:Timings" "Help:Timings"
    "Help:Softness and size" "Help:Softness and size"
    "File:Keep shape" "File:Undo keep shape" "File:Detach" "File:Return to the origin" "File:Snapshot"
)

# choose MENU ENTRY: an entry that is not there, or cannot be chosen now, is a click beside it.
choose() {
    local at x y width
    for name in "$@"; do
        at=$(place "$name") || exit 1
        read -r x y width <<<"$at"
        xdotool mousemove "$x" "$y" click 1
        settle 3
    done
}

# choose_all: every entry of every menu. The story begins anew again and again: at its end a card offers
# the hand, and a click beside an entry would take it.
choose_all() {
    local entry count=0
    for entry in "${entries[@]}"; do
        xdotool key Escape
        [ $((count++ % 6)) -ne 0 ] || xdotool key comma
        choose "${entry%%:*}" "${entry#*:}"
        alive
        ! grep -q 'the hand is now' "$log" || fail "$entry changes the hand"
    done
    xdotool key Escape
    settle
    no_panic
}

work_in() {
    cd "$work"
    export XDG_RUNTIME_DIR="$work/runtime"
    mkdir -m 700 "$XDG_RUNTIME_DIR"
    unset WAYLAND_DISPLAY
}

# growth: memory of the program, MB.
memory_mb() {
    awk '/VmRSS/ { printf "%d", $2 / 1024 }' "/proc/$client_pid/status"
}

work_in
open_display 1920x1080

for size in ${SIZES:-800x600 1280x800 1920x1080}; do
    step "$size: the story, and every key in each of its states"
    begin "story-$size" run --object strawberry
    xdotool windowsize "$window" "${size%x*}" "${size#*x}"
    settle
    seen approach
    press_all
    xdotool key comma
    mark
    await 'news .*entered Deforming'
    settle 8
    seen squeezed
    press_all
    xdotool key comma
    mark
    await 'news .*shape kept'
    settle
    seen kept
    press_all
    if [ "$size" = 800x600 ]; then
        step "$size: every entry of every menu"
        choose_all
    fi
    step "$size: the story ends with the person's turn, and begins anew"
    xdotool key comma
    mark
    await 'places: name="Take the hand"' 90
    settle
    seen turn
    await 'the script begins anew' 60
    step "$size: who holds Space squeezes"
    mark
    xdotool keydown space
    await 'news .*entered Deforming' 60
    settle 4
    xdotool keyup space
    seen own-squeeze
    press_all
    xdotool key F4
    settle
    seen softness
    xdotool key ctrl+q
    ended
done

size=800x600
step "letters that are typed into a dialog are no shortcuts, and a shortcut is no letter"
begin typing run --hand mouse --object cube
mark
xdotool key ctrl+o
await 'places: name="file name"'
settle 3
xdotool type --delay 30 "cart.prk"
xdotool key Return
notice 'cart\.prk'
await 'places: name="why not"'
! new_lines | grep -qE 'wish="(Next colouring|Snapshot|Record|Keep)' || fail "a typed letter was a wish"
new_lines | grep -E 'notice .*cart\.prk' | grep -qE '[ "/]cart\.prk' || fail "Ctrl+O typed an o"
mark
step "who browses where the system has no dialog of its own is told"
click "Browse"
await 'places: name="why not"' 30
xdotool key Escape
settle
xdotool key ctrl+q
ended

step "a slider of softness that is drawn makes another object, without a restart"
begin softness run --hand mouse --object cube
await 'model ready'
xdotool key F4
await 'places: name="stiffness"'
settle 4
# The slider lies at the left of its number.
at=$(place stiffness) || exit 1
read -r x y width <<<"$at"
mark
xdotool mousemove $((x - width / 5)) "$y" mousedown 1
for n in 1 2 3 4; do
    xdotool mousemove $((x - width / 5 + 8 * n)) "$y"
    settle 1
done
xdotool mouseup 1
await 'model ready'
xdotool key ctrl+q
ended

step "spheres and colliders do not cost memory for each picture"
begin memory run --object cube --hand scripted:approach
xdotool key l t t t
settle 10
before=$(memory_mb)
settle 40
after=$(memory_mb)
[ $((after - before)) -lt 90 ] || fail "40 pictures took $((after - before)) MB"
xdotool key ctrl+q
ended

step "nothing of the libraries is on standard error"
"$client" run --object cube --nodes 200 --frames 30 >plain.out 2>plain.log || fail "a plain run failed"
[ ! -s plain.log ] || fail "standard error says: $(head -n 3 plain.log)"

say "newcomer passed ($SECONDS s)"
