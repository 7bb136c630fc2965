"""Another finite-element model of a finger, for studies/tetrahedra.py."""
