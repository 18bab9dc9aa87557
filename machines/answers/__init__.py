"""Functions named like the verbs: what a verb does, for programs, and results with a sentence, a table and a picture.

Imports every room before it. A verb reads its words, calls the function here and prints what it returns.
"""
