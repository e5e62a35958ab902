"""Why the twin and the bench disagree: where the gap lies, which unmodelled effect causes it, how
far it shrinks."""
