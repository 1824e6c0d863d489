"""
Recordings, planned trajectories and datasets, judged as the node would have judged them: `audit`.

`readers/` and `datasets/` make blocks of joint states of files; `audit/` gives these to the node's
own estimator and to the kernel in batches, and makes findings; `audit/report/` writes page, JSON
and bag. `plans/` makes verdicts of a plan, between its points too; `family_paths/` makes plans of
a redundant arm through targets; `sweep.py` spreads batches over processes of a cluster.
`commands/` has the command and its options.
"""
