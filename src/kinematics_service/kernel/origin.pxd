from .layout cimport places

cpdef bytes source()
