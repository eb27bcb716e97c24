"""The judge: what is true of a route, a claim or a certificate.  Imports no solver."""
