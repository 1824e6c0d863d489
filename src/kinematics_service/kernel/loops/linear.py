"""Systems of up to six linear equations, by elimination with partial pivoting."""

from ..layout.arrays import Numbers


def factorise(A: Numbers, size: int, order: list[int]) -> float:
    """
    Turn A (size, size) into its factors, the order of its rows noted; return its determinant.

    At 0 the factors are of no use.
    """
    product = 1.0
    for i in range(size):
        order[i] = i
    for i in range(size):
        pivot = i
        for j in range(i + 1, size):
            if abs(A[j * size + i]) > abs(A[pivot * size + i]):
                pivot = j
        if A[pivot * size + i] == 0.0:
            return 0.0
        if pivot != i:
            product = -product
            order[i], order[pivot] = order[pivot], order[i]
            for k in range(size):
                A[i * size + k], A[pivot * size + k] = A[pivot * size + k], A[i * size + k]
        product *= A[i * size + i]
        for j in range(i + 1, size):
            factor = A[j * size + i] / A[i * size + i]
            A[j * size + i] = factor
            for k in range(i + 1, size):
                A[j * size + k] -= factor * A[i * size + k]
    return product


def solve(A: Numbers, size: int, order: list[int], b: Numbers) -> None:
    """Turn b into the solution of A x = b, A as `factorise` left it."""
    x = [0.0] * 6
    for i in range(size):
        x[i] = b[order[i]]
        for k in range(i):
            x[i] -= A[i * size + k] * x[k]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            x[i] -= A[i * size + k] * x[k]
        x[i] /= A[i * size + i]
    for i in range(size):
        b[i] = x[i]


def solve_transposed(A: Numbers, size: int, order: list[int], b: Numbers) -> None:
    """Turn b into the solution of A' x = b, A as `factorise` left it."""
    x = [0.0] * 6
    for i in range(size):
        x[i] = b[i]
        for k in range(i):
            x[i] -= A[k * size + i] * x[k]
        x[i] /= A[i * size + i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            x[i] -= A[k * size + i] * x[k]
    for i in range(size):
        b[order[i]] = x[i]
