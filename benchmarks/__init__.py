# SPDX-License-Identifier: GPL-3.0-or-later
"""What the project measures.

Scripts run from the repository's root as ``python -m benchmarks.FOLDER.SCRIPT``.

==========  ================================================================
`speed`     time and memory, also of two states of the code side by side
`peers`     other methods at equal count
`paper`     the paper's tables and figures, and what each of its parts adds
`common`    models and shapes to measure on, and the peak of memory
==========  ================================================================
"""
