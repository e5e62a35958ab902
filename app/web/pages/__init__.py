"""Pages, one theme a file; `ROUTERS` in `..routes` lists them."""
