"""The commands that the pages show, taken out of them, parsed and run: for
tests/docs/test_pages.py.

A page is run from top to bottom in a folder of its own, as somebody would who pastes its blocks one
after the other. HTML comments before a block, which no reader of the page sees, tell what is there
beforehand and what is not run:

    <!-- given: folder hammer spring; recording shot.csv -->    what `givens.py` prepares
    <!-- not run: needs a second machine -->                    the block is parsed only, for this
                                                                reason
    <!-- exit code: 2 -->                                       of the block's last command, where
                                                                it is not 0

A block of language `text` right after a block of commands is what they print: every line of it in
this order, numbers within 2 %; a line of `…` alone stands for any others, one that ends with `…` is
the beginning of a line.
"""
