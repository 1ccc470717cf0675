# SPDX-License-Identifier: GPL-3.0-or-later
# completion.bash — completes beamfit's command line in bash; tools/completion.c puts the tables above it.

# One value of a kind: words "=a b", an effect, a file by the ends "csv" or "yaml|yml", a directory, a port, any file.
_beamfit_complete() {
    local kind=$1 end list done
    case $kind in
    *,...)
        [[ $kind == =* ]] && list=${kind:1:-4} || list=$_beamfit_effects
        done=${cur%"${cur##*,}"} # what stands before the last comma
        COMPREPLY+=($(compgen -P "$done" -W "$list" -- "${cur##*,}"))
        compopt -o nospace 2>/dev/null
        ;;
    =*) COMPREPLY+=($(compgen -W "${kind:1}" -- "$cur")) ;;
    effect) COMPREPLY+=($(compgen -W "$_beamfit_effects" -- "$cur")) ;;
    command) COMPREPLY+=($(compgen -W "$_beamfit_commands" -- "$cur")) ;;
    '') ;;
    *)
        local IFS=$'\n'
        compopt -o filenames 2>/dev/null
        case $kind in
        port) COMPREPLY+=($(compgen -G '/dev/tty[UA][SC][BM]*' | grep -F -- "$cur")) ;;
        directory) COMPREPLY+=($(compgen -d -- "$cur")) ;;
        file) COMPREPLY+=($(compgen -f -- "$cur")) ;;
        *)
            COMPREPLY+=($(compgen -d -- "$cur"))
            IFS='|'
            for end in $kind; do
                IFS=$'\n'
                COMPREPLY+=($(compgen -f -X "!*.$end" -- "$cur"))
            done
            ;;
        esac
        ;;
    esac
}

# Which of the command's words stands at the cursor, counted from 0, options and their values left out.
_beamfit_place() {
    local i word
    place=0
    for ((i = 2; i < COMP_CWORD; i++)); do
        word=${COMP_WORDS[i]}
        if [[ ${COMP_WORDS[i + 1]} == = && $word == --* ]]; then
            ((i += 2))
        elif [[ $word == -?* ]]; then
            [[ -n ${values[$word]+there} ]] && ((i++))
        else
            ((place++))
        fi
    done
}

_beamfit() {
    local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD - 1]} options again=0 place
    local -A values=()
    local -a places=()
    COMPREPLY=()
    if ((COMP_CWORD == 1)); then
        COMPREPLY=($(compgen -W "$_beamfit_commands --help --version" -- "$cur"))
        return
    fi
    if [[ ${COMP_WORDS[1]} == help ]]; then
        _beamfit_complete command
        return
    fi
    _beamfit_table "${COMP_WORDS[1]}" || return
    # bash parts words at '=': '--start=near' arrives as three
    if [[ $cur == = ]]; then
        cur=
    elif [[ $prev == = ]] && ((COMP_CWORD > 2)); then
        prev=${COMP_WORDS[COMP_CWORD - 2]}
    fi
    if [[ -n ${values[$prev]+there} ]]; then
        _beamfit_complete "${values[$prev]}"
    elif [[ $cur == -* ]]; then
        COMPREPLY=($(compgen -W "$options" -- "$cur"))
    else
        _beamfit_place
        if ((place >= ${#places[@]} && again && ${#places[@]} > 0)); then
            place=$((${#places[@]} - 1))
        fi
        _beamfit_complete "${places[place]}"
    fi
}
complete -F _beamfit beamfit
