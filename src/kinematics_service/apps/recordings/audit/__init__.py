"""
Recordings and planned trajectories judged as the node would have judged them.

Joint states go through the node's own estimator, then in batches through the kernel, and message
by message through the node's own rules for warnings.
"""
