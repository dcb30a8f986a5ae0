"""Server of the workbench: who may ask, what is answered where, events; the only folder that knows a web server."""
