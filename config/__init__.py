"""
The bundled robots: one YAML file each, found by name.

"""
