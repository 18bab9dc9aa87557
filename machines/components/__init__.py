"""What a machine is made of: lumped, rigid, modal, beam, state-space and measured parts, matrices, and connections.

Imports shapes.
"""
