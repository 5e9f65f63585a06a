# Completion of NAME for fish; written by `NAME completion fish`.
function __NAME_candidates
  set -l words (commandline --tokenize --cut-at-cursor --current-process)
  set -l found ($words[1] ASK $words[2..] (commandline --current-token --cut-at-cursor) 2>/dev/null)
  if test (count $found) -eq 0
    __fish_complete_path (commandline --current-token --cut-at-cursor)
  else
    printf '%s\n' $found
  end
end
complete --command NAME --no-files --arguments '(__NAME_candidates)'
