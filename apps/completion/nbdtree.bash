# Completion of nbdtree in bash: commands, options and their named choices, as --help tells them, else files. Install it
# as /usr/share/bash-completion/completions/nbdtree, or `source` it.
_nbdtree() {
    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} program=${COMP_WORDS[0]} command='' help i
    for ((i = 1; i < COMP_CWORD; ++i)); do
        [[ ${COMP_WORDS[i]} == -* ]] || { command=${COMP_WORDS[i]}; break; }
    done
    COMPREPLY=()
    if [ -z "$command" ] && [[ $word != -* ]]; then
        help=$("$program" --help 2>/dev/null | sed -n '/^Subcommands:/,$s/^  \([a-z][a-z_]*\) .*/\1/p')
        mapfile -t COMPREPLY < <(compgen -W "$help" -- "$word")
        return
    fi
    help=$("$program" $command --help 2>/dev/null; [ -z "$command" ] || "$program" --help 2>/dev/null | sed '/^Subcommands:/,$d')
    if [[ $word == -* ]]; then
        mapfile -t COMPREPLY < <(compgen -W "$(sed -n 's/^  \(-[^ ]*\).*/\1/p' <<<"$help" | tr , '\n')" -- "$word")
        return
    fi
    # The choices that the line of the option before names in braces.
    local choices
    choices=$(grep -E "^  ([^ ]*,)?$before[ ,]" <<<"$help" | grep -oE '\{[A-Za-z0-9_,-]+\}' | head -1 | tr -d '{}' | tr , '\n')
    [[ $before == -* && -n $choices ]] && mapfile -t COMPREPLY < <(compgen -W "$choices" -- "$word")
    [ ${#COMPREPLY[@]} -gt 0 ] || mapfile -t COMPREPLY < <(compgen -f -- "$word")
}
complete -o filenames -F _nbdtree nbdtree
