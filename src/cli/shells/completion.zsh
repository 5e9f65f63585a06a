#compdef NAME
# Completion of NAME for zsh; written by `NAME completion zsh`.
_NAME() {
  local -a lines candidates folders
  local line word
  lines=("${(@f)$($words[1] ASK "${(@)words[2,CURRENT]}" 2>/dev/null)}")
  for line in $lines; do
    word=${line%%$'\t'*}
    if [[ $word == */ ]]; then
      folders+=($word)
    elif [[ -n $word ]]; then
      candidates+=("${word//:/\\:}:${line#*$'\t'}")
    fi
  done
  if (( $#folders + $#candidates == 0 )); then
    _files
    return
  fi
  (( $#folders == 0 )) || compadd -S '' -- $folders
  (( $#candidates == 0 )) || _describe NAME candidates
}
if [[ $zsh_eval_context[-1] == loadautofunc ]]; then
  _NAME "$@"
else
  compdef _NAME NAME
fi
