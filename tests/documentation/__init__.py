"""The pages: what they claim and where they lead."""
