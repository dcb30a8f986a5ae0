"""Tables in text: frequency responses and time histories."""
