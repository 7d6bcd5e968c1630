# SPDX-License-Identifier: GPL-3.0-or-later
"""Clouds in tiles: each is analysed and put into order by itself, and one count holds for all.

plan   boxes of about so many points, and the width of their halos
tile   what is worked out for one tile: its maps and surface, the order in which its core goes
merge  what all tiles together come to: the scale of saliency, mean areas, the cut of a count

Everything here takes and returns arrays; files, processes and clusters are the hosts' affair.
"""
