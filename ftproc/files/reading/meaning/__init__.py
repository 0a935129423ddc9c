"""What the columns of a log mean: names, units, numbers, angles, missing readings, several targets.

`names` takes a name apart, `schema` finds the columns, `plausibility` judges their values. Calls `files`,
`files.reading.formats`.
"""
