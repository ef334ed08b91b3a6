# Prints the command line after a Tab in an interactive zsh. Usage: complete.zsh FUNCTIONS_DIR TEXT
zmodload zsh/zpty
zpty -b shell zsh -f -i
zpty -w shell "PS1= ; unset zle_bracketed_paste; fpath=($1 \$fpath); autoload -U compinit; compinit -D -u"
zpty -w shell 'finish() { print -r -- "<<$BUFFER>>"; exit }; zle -N finish; bindkey "^X" finish; bindkey "^I" complete-word'
zpty -w shell 'print rea""dy'
zpty -r shell said '*ready*'
zpty -w -n shell "$2"$'\t\x18'
zpty -r shell said '*<<*>>*'
said=${said##*<<}
print -r -- "${${said%%>>*}%% }"
