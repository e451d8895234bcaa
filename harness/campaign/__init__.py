"""Monte-Carlo campaigns: many flights, their results and their answers."""
