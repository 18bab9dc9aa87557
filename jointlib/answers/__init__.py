"""Functions named like the verbs about joints: files or objects in, files written where asked, results out."""
