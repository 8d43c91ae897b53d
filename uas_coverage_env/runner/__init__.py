"""Many missions: one runner of jobs (`jobs`), and one store of what came of them (`store`)."""
