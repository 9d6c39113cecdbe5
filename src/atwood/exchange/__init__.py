"""Exchange with other tools: scenes as C and as FMUs, FMUs as parts, robots' files in and out."""
