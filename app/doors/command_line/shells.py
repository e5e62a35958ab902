"""Completion in bash, zsh and fish, where the scripts that click makes lose `@`, `,` and
`--option=` of a word."""

from __future__ import annotations

import os

from click.shell_completion import (
    BashComplete,
    CompletionItem,
    FishComplete,
    ShellComplete,
    ZshComplete,
    add_completion_class,
    split_arg_string,
)

#: bash divides a word at `@`, `=` and `:`. A reply replaces what stands behind the last of them,
#: and the `@` itself.
_BASH_BEFORE = r"""local response
    local line="${COMP_LINE:0:COMP_POINT}"
    local word="${line##* }" breaks="${COMP_WORDBREAKS//[^@=:]/}" before=""
    [[ -n $breaks ]] && before="${word%%"${word##*[$breaks]}"}" && before="${before%%@}"
"""


class _CompleteOptionValues(ShellComplete):
    """Names behind `--option=` keep the option: a shell replaces the whole word."""

    def get_completions(self, args: list[str], incomplete: str) -> list[CompletionItem]:
        items = super().get_completions(args, incomplete)
        option, equals, _ = incomplete.partition("=")
        if option.startswith("--") and equals:
            for item in items:
                if item.type == "plain":
                    item.value = f"{option}={item.value}"
        return items


class _Bash(_CompleteOptionValues, BashComplete):
    """The whole line goes to the program, and of each reply what bash keeps anyway is taken
    away."""

    source_template = (
        BashComplete.source_template.replace("local response\n", _BASH_BEFORE)
        .replace('COMP_WORDS="${COMP_WORDS[*]}"', 'COMP_WORDS="$line"')
        .replace("COMPREPLY+=($value)", 'COMPREPLY+=("${value#"$before"}")')
    )

    def get_completion_args(self) -> tuple[list[str], str]:
        line = os.environ["COMP_WORDS"]
        words = split_arg_string(line)[1:]
        return (words, "") if line[-1:].isspace() or not words else (words[:-1], words[-1])


class _Zsh(_CompleteOptionValues, ZshComplete):
    """Files behind `--option=` are found, too."""

    source_template = ZshComplete.source_template.replace(
        "_path_files", "[[ $PREFIX == --*=* ]] && compset -P 1 '*='; _path_files"
    )


class _Fish(_CompleteOptionValues, FishComplete):
    """A name may stand behind a comma: an answer is divided at its first comma alone."""

    source_template = FishComplete.source_template.replace(
        'string split ","', 'string split --max 1 ","'
    )


def register_shells() -> None:
    """Let click use these in place of its own, wherever the program is asked for a completion."""
    for shell in (_Bash, _Zsh, _Fish):
        add_completion_class(shell)
