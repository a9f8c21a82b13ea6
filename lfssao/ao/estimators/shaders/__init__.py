"""Published shaders: a TOML file of each has its choices and their sources, a module the formulas that are its own."""
