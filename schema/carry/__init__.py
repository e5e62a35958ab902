"""Campaigns from laboratory to laboratory: a file that holds one, and what becomes of it where others are."""
