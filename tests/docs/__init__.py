"""The pages of the project. `make readme` writes every table and every command output in them.

`blocks` lists the parts of the pages that commands write, `shell` runs the commands, `pages` puts their text between
the marks. `reference` and `picture` are commands of their own."""
