"""What a person sees: tables, live lines, pictures, pages."""
