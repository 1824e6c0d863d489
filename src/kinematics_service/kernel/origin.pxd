from . cimport places

cpdef bytes source()
