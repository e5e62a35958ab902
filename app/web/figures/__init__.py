"""Charts as plotly's plain JSON, one theme a file; the browser draws them in its own colours."""
