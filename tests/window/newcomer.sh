#!/usr/bin/env bash
# A curious newcomer: presses every key in every state of the story and of the hand, in windows of three
# sizes, and chooses every entry of every menu in each of the sizes and each of the states; draws the sliders
# of softness, takes the hand, waits for the story to begin anew, and looks what it costs. Ends as
# tests/window/run.sh does.
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

# -- Keys

# Every key that does something whatever hand acts, each as often as it takes to come back to where it
# began. F, which takes the eye, is pressed last of all.
keys=(c c c c c w w g g h h l l o o n n t t shift+t shift+t F1 Escape F1 F1 F2 F2 F3 F3 F4 F4
    r p r period Return Return k ctrl+z BackSpace Home Tab ctrl+o Escape ctrl+s Escape)
# Those that move a hand of the mouse.
hand_keys=(space x 1 2 3 4 5 shift+1 shift+2 shift+3 shift+4 shift+5 Left Right Up Down Prior Next
    a d q e Tab f)

# press KEY...: one after the other.
press() {
    local key
    for key in "$@"; do
        xdotool key "$key" sleep 0.05
        alive
    done
    settle
    no_panic
}

# -- Menus

menus=(File Object Hand Solve View Help)
# Entries that stay where they are, but for Exit, which ends each window, and for objects and hands.
entries=(
    "File:Keep shape" "File:Undo keep shape" "File:Detach" "File:Return to the origin" "File:Snapshot"
    "File:Record pictures" "File:End recording" "File:Read file …" "File:Save as …"
    "Object:Read file …" "Object:Softness and size" "Object:Softness and size"
    "Solve:condensed" "Solve:front" "Solve:front-mixed" "Solve:pcg" "Solve:1 %" "Solve:0.01 %"
    "Solve:0.0001 %" "Solve:rounding only" "Solve:auto"
    "View:Displacement" "View:Largest principal strain" "View:Von Mises stress"
    "View:Estimated stress error" "View:Plain"
    "View:show Elements" "View:show Elements" "View:show Shape at rest" "View:show Shape at rest"
    "View:show Hand" "View:show Hand" "View:show Colliders" "View:show Colliders"
    "View:show Contacts" "View:show Contacts" "View:show Forces" "View:show Forces"
    "View:Next level of the sphere tree" "View:Last level of the sphere tree"
    "View:Fair light" "View:Full light" "View:Plain light"
    "Help:Help" "Help:Help" "Help:Information" "Help:Information" "Help:Timings" "Help:Timings"
    "Help:Softness and size" "Help:Softness and size"
)
objects=(Cube Sphere Toothpaste Turtle Liver Bunny Strawberry)
scripts=(approach attach squeeze release regrasp lift)

# Centre of each menu and entry in this window: a menu opens always at the same place.
declare -A at=()

# at_place NAME: X and Y, as the log told them last.
at_place() {
    local x y width
    read -r x y width <<<"$(place "$1")"
    echo "$x $y"
}

# learn_menus: opens each menu once, and looks where its entries are.
learn_menus() {
    local menu line name
    at=()
    for menu in "${menus[@]}"; do
        at["$menu"]=$(at_place "$menu")
        mark
        # shellcheck disable=SC2086
        xdotool mousemove ${at[$menu]} click 1
        settle 4
        while read -r line; do
            name=$(sed -E 's/.*places: name="([^"]*)" x=.*/\1/' <<<"$line")
            at["$menu:$name"]=$(sed -E 's/.* x=(-?[0-9]+) y=(-?[0-9]+) .*/\1 \2/' <<<"$line")
        done < <(new_lines | grep -F 'places: name="')
        xdotool key Escape
        settle 3
    done
}

# choose MENU:ENTRY: opens the menu, and chooses the entry when it is drawn.
choose() {
    local menu="${1%%:*}" of_menu of_entry
    of_menu="${at[$menu]}" of_entry="${at[$1]:-}"
    # The one entry that has another name while it is at work.
    [ "$1" != "File:End recording" ] || of_entry="${at[File:Record pictures]}"
    [ -n "$of_entry" ] || fail "there is no entry $1"
    # shellcheck disable=SC2086
    xdotool mousemove $of_menu click 1
    settle 2
    # shellcheck disable=SC2086
    xdotool mousemove $of_entry click 1
    settle 1
    case "$1" in
        *"Read file …" | *"Save as …") settle 2 && xdotool key Escape && settle 1 ;;
    esac
    alive
}

# choose_all STATE: every entry of every menu, in the state that is there. That takes most of a minute, so
# each window tries one or two states, and all together every one.
choose_all() {
    local entry
    case "$size $1" in
        "800x600 squeezed" | "800x600 own" | "1280x800 kept" | "1280x800 turn" | "1920x1080 approach") ;;
        *) return 0 ;;
    esac
    for entry in "${entries[@]}"; do
        choose "$entry"
    done
    settle
    no_panic
}

# heard_all: every entry that was chosen and every key that was pressed was heard by the window.
heard_all() {
    local entry wish
    for entry in "${entries[@]}" "Keys:From the beginning" "Keys:One tick" "Keys:Play or pause" \
        "Keys:Next colouring" "Keys:Frame the scene"; do
        wish="${entry#*:}"
        wish="${wish#show }"
        case "$wish" in "End recording") continue ;; esac
        grep -qF "places: wish=\"$wish\"" "$log" || fail "nobody heard $entry"
    done
}

# -- What it costs

drawn() { grep -c 'places: picture=' "$log" || true; }

memory_mb() {
    awk '/VmRSS/ { printf "%d", $2 / 1024 }' "/proc/$client_pid/status"
}

# Time of processors that the program has used, in hundredths of a second.
processor_ticks() {
    awk '{ print $14 + $15 }' "/proc/$client_pid/stat"
}

# costs_little: a story that waits for the person draws a picture now and then, and asks for no tick.
costs_little() {
    local pictures_before cpu_before pictures_drawn cpu
    # What moved the mouse last is over by then.
    sleep 2.5
    mark
    pictures_before=$(drawn) cpu_before=$(processor_ticks)
    sleep 4
    pictures_drawn=$(($(drawn) - pictures_before)) cpu=$(($(processor_ticks) - cpu_before))
    say "  in 4 s of waiting: $pictures_drawn pictures, $cpu hundredths of a second of processor"
    # Four a second are drawn, and one more as the card counts.
    [ "$pictures_drawn" -le 24 ] || fail "$pictures_drawn pictures in 4 s in which nothing moves"
    [ "$cpu" -le 320 ] || fail "the finished story keeps a processor busy: $cpu of 400 hundredths"
    ! new_lines | grep -q 'news ' || fail "ticks are played after the story's end"
}

# slide NAME FROM TO: draws the handle of a slider by so many pixels from its left end.
slide() {
    local x y width left
    read -r x y width <<<"$(place "$1")"
    left=$((x - width / 2))
    xdotool mousemove $((left + $2)) "$y" mousedown 1
    settle 2
    xdotool mousemove $((left + ($2 + $3) / 2)) "$y"
    settle 2
    xdotool mousemove $((left + $3)) "$y"
    settle 2
    xdotool mouseup 1
    settle 2
}

# -- The steps

cd "$work"
export XDG_RUNTIME_DIR="$work/runtime"
mkdir -m 700 "$XDG_RUNTIME_DIR"
unset WAYLAND_DISPLAY
open_display 1920x1080

# story_until PATTERN: the story from its beginning, held where the log says so.
story_until() {
    xdotool key comma
    mark
    await "$1"
    settle 6
    xdotool key Return
    settle
}

for size in ${SIZES:-800x600 1280x800 1920x1080}; do
    step "$size: every key and every entry on the approach"
    begin "story-$size" run
    xdotool windowsize "$window" "${size%x*}" "${size#*x}"
    settle
    seen approach
    learn_menus
    press "${keys[@]}"
    xdotool key comma
    settle
    choose_all approach
    step "$size: … while it is squeezed"
    story_until 'news .*entered Deforming'
    seen squeezed
    choose_all squeezed
    xdotool key Return
    press "${keys[@]}"
    step "$size: … with a kept shape"
    story_until 'news .*shape kept'
    seen kept
    choose_all kept
    xdotool key Return
    press "${keys[@]}"
    step "$size: the story ends with the person's turn, costs little, and begins anew"
    xdotool key comma
    mark
    await 'places: name="Take the hand"' 90
    settle
    seen turn
    costs_little
    choose_all turn
    await 'the script begins anew' 60
    step "$size: who holds Space squeezes; every key and every entry with the own hand"
    mark
    xdotool keydown space
    await 'news .*entered Deforming' 60
    settle 4
    seen own-squeeze
    xdotool keyup space
    press "${keys[@]}" "${hand_keys[@]}"
    choose_all own
    step "$size: every hand, and every object"
    for script in "${scripts[@]}"; do
        mark
        choose "Hand:Script: $script"
        notice "the hand is now scripted:$script"
    done
    mark
    choose "Hand:Mouse and keyboard"
    notice "the hand is now mouse"
    for object in "${objects[@]}"; do
        mark
        choose "Object:$object"
        notice "the object is now ${object,}"
        settle
        seen "object-${object,}"
    done
    choose "View:Frame the scene"
    heard_all
    menu "Exit"
    ended
done

size=800x600
step "the sliders of stiffness, size and fineness are drawn: the object becomes another, without a new start"
begin sliders run --object cube --nodes 300
xdotool key F4
settle 4
seen softness
for slider in stiffness "Poisson's ratio" size nodes; do
    mark
    slide "$slider" 40 95
    case "$slider" in
        size | nodes) notice "the object is now cube" ;;
        *) notice "the object is now of" ;;
    esac
done
mark
await 'news .*entered Deforming' 90
xdotool key ctrl+q
ended

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

step "a large object is prepared, and the story waits for it"
begin large run --object strawberry --nodes 20000
await 'news .*model ready' 240
! grep -qE 'news .*entered (Attached|Deforming)' "$log" || fail "the story was played without the server"
grep -q 'places: name="preparing"' "$log" || fail "nothing said that the object is prepared"
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
