#!/usr/bin/env bash
# A curious newcomer: presses every key and every entry of every menu, in every state of the story and
# of the hand; then waits for the story to begin anew, takes the hand, and looks what it costs. Larger
# windows, which take the processor long to draw, get every key in one state and every menu, or all of it
# where somebody waits for it. Ends as tests/window/run.sh does.
#
#   BIN_DIR=target/debug tests/window/newcomer.sh [FOLDER]     keeps a picture of each state in FOLDER
#   SIZES="800x600 1280x800" …                                 windows of these sizes only
#   EVERY_SIZE=1 …                                             all of it in windows of all sizes
set -euo pipefail
pictures="${1:+$(mkdir -p "$1" && cd "$1" && pwd)}"
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/window/driving.sh
source tests/window/driving.sh

# seen NAME: a picture of the window, where pictures are kept.
seen() {
    [ -n "$pictures" ] && command -v import >/dev/null || return 0
    import -window root -crop "$size+0+0" +repage "$pictures/$size-${1// /-}.png"
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

# Every entry of every menu but Exit, which ends the window below; behind "=" the key that takes back what
# it does. The object and the hand that the story has come last of theirs.
entries=(
    "Object:Cube" "Object:Sphere" "Object:Toothpaste" "Object:Strawberry"
    "Object:Read file …=Escape" "Object:page Softness and size=F4"
    "Solve:condensed" "Solve:front" "Solve:front-mixed" "Solve:pcg" "Solve:auto"
    "Solve:1 %" "Solve:0.01 %" "Solve:0.0001 %" "Solve:rounding only"
    "View:Displacement" "View:Largest principal strain" "View:Von Mises stress"
    "View:Estimated stress error" "View:Plain"
    "View:show Elements=w" "View:show Shape at rest=g" "View:show Hand=h" "View:show Colliders=l"
    "View:show Contacts=o" "View:show Forces=n" "View:Next level of spheres" "View:Previous level of spheres"
    "View:Fair light" "View:Full light" "View:Plain light" "View:Frame the scene"
    "Help:page Help=Escape" "Help:page Information=F2" "Help:page Timings=F3" "Help:page Softness and size=F4"
    "File:Read file …=Escape" "File:Save as …=Escape" "File:Keep shape" "File:Undo keep shape" "File:Detach"
    "File:Return to the origin" "File:Snapshot" "File:Record pictures" "File:End recording"
    "right button:Detach" "right button:Return to the origin" "right button:Save as …=Escape"
    "Hand:Mouse and keyboard" "Hand:Script: approach" "Hand:Script: attach" "Hand:Script: squeeze"
    "Hand:Script: release" "Hand:Script: regrasp" "Hand:Script: lift"
)
# What the log tells the place of besides.
others="File|Object|Hand|Solve|View|Help|Exit|Take the hand|time line|preparing|newest|Cancel loading"
others+="|Play or pause|One tick|From the beginning|stiffness|Poisson's ratio|size|nodes"

# open_menu MENU: from the bar, or the pop-up menu in the corner, where it has no room below.
open_menu() {
    local at x y width
    mark
    if [ "$1" = "right button" ]; then
        xdotool mousemove $((${size%x*} - 25)) $((${size#*x} - 90)) click 3
    else
        at=$(place "$1") || exit 1
        read -r x y width <<<"$at"
        xdotool mousemove "$x" "$y" click 1
    fi
    case "$1" in
        Hand) await 'places: name="Script: lift"' ;;
        Object) await 'places: name="page Softness and size"' ;;
        Solve) await 'places: name="rounding only"' ;;
        View) await 'places: name="Frame the scene"' ;;
        Help) await 'places: name="page Help"' ;;
        *) await 'places: name="Exit"' ;;
    esac
    # A menu is measured before it stands where it stays.
    settle
}

# all_are_tried MENU: what the open menu has is in the list.
all_are_tried() {
    local name
    while read -r name; do
        case " ${entries[*]/#/|} " in
            *"|$1:$name"*) ;;
            *) fail "the entry '$name' of the menu $1 is tried by nobody" ;;
        esac
    done < <(new_lines | sed -nE 's/.*places: name="([^"]+)" x=.*/\1/p' | grep -vxE "$others" | sort -u)
}

# choose MENU ENTRY: the entry is in the window, and is heard.
choose() {
    local at x y width wish="${2#show }"
    open_menu "$1"
    if [[ "$opened" != *" $1 "* ]]; then
        opened+=" $1 "
        seen "menu $1"
        # The pop-up menu has the entries of File.
        [ "$1" = "right button" ] || all_are_tried "$1"
    fi
    at=$(place "$2") || exit 1
    read -r x y width <<<"$at"
    ((x - width / 2 >= 0 && x + width / 2 <= ${size%x*} && y >= 0 && y < ${size#*x})) ||
        fail "$1, $2 lies outside the window, at $x $y"
    xdotool mousemove "$x" "$y" click 1
    case "$2" in
        # They can be chosen in some states only.
        "Keep shape" | "Undo keep shape") settle; xdotool key Escape ;;
        "End recording") await 'wish="Record pictures"' ;;
        *) await "wish=\"${wish#page }\"" ;;
    esac
    # A menu that is chosen from closes in the next picture.
    settle 1
}

# look_at_menus: every menu opens, and all its entries lie in the window.
look_at_menus() {
    local menu name x y width opened=""
    for menu in File Object Hand Solve View Help; do
        open_menu "$menu"
        seen "menu $menu"
        all_are_tried "$menu"
        while IFS='|' read -r name x y width; do
            ((x - width / 2 >= 0 && x + width / 2 <= ${size%x*} && y >= 0 && y < ${size#*x})) ||
                fail "$menu, $name lies outside the window, at $x $y"
        done < <(new_lines |
            sed -nE 's/.*places: name="([^"]+)" x=(-?[0-9]+) y=(-?[0-9]+) width=([0-9]+).*/\1|\2|\3|\4/p')
        xdotool key Escape
        settle
        alive
    done
    no_panic
}

# choose_all: every entry of every menu, while the story begins anew again and again: at its end a card
# offers the hand.
choose_all() {
    local entry name count=0 opened=""
    for entry in "${entries[@]}"; do
        [ $((count++ % 6)) -ne 0 ] || xdotool key comma
        name="${entry%=*}"
        choose "${name%%:*}" "${name#*:}"
        case "$entry" in
            *=*)
                settle 1
                seen "${name#*:}"
                xdotool key "${entry##*=}"
                settle
                ;;
            Object:*)
                name="${name#*:}"
                await "the object is now ${name,}"
                ;;
            Hand:*) await 'the hand is now' ;;
            "View:Fair light" | "View:Full light") await 'notice text="The processor draws here' ;;
        esac
        alive
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
    is_whole=""
    [ "$size" != 800x600 ] && [ -z "${EVERY_SIZE:-}" ] || is_whole=1
    [ -n "$is_whole" ] && states="each of its states" || states="its squeeze"
    step "$size: the story, and every key in $states"
    begin "story-$size" run --grasp thesis --object strawberry
    xdotool windowsize "$window" "${size%x*}" "${size#*x}"
    settle
    seen approach
    [ -z "$is_whole" ] || press_all
    xdotool key comma
    mark
    await 'news .*entered Deforming'
    settle 8
    seen squeezed
    press_all
    if [ -z "$is_whole" ]; then
        step "$size: every menu"
        look_at_menus
        open_menu File
        click Exit
        ended
        continue
    fi
    xdotool key comma
    mark
    await 'news .*shape kept'
    settle
    seen kept
    press_all
    step "$size: every entry of every menu"
    choose_all
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
    xdotool key F4 F2
    settle
    seen information
    open_menu File
    click Exit
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
