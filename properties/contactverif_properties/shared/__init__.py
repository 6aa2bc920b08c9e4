"""Code that several properties share: tolerances, kinks, states, exact forces, and solved scenes.

Rule for the next editor: nothing here imports a property.
"""
