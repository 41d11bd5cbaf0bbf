# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What a picture of bright dots shows, measured as simply as can be."""
import numpy as np


def bright_spots(image, uv, half):
    """Centroids (K, 2) px and areas (K,) px^2, at half height, of bright dots near places uv (K, 2) px, in boxes of 2 half + 1 px."""
    green = image[..., 1].astype(float)
    places, areas = [], []
    for u, v in np.round(uv).astype(int):
        box = green[v - half:v + half + 1, u - half:u + half + 1]
        low, high = np.percentile(box, 10), np.percentile(box, 95)
        share = np.clip((box - low) / (high - low), 0, 1)
        share[share < 0.15] = 0
        y, x = np.mgrid[v - half:v + half + 1, u - half:u + half + 1]
        places.append([(share * x).sum() / share.sum(), (share * y).sum() / share.sum()])
        areas.append(share.sum())
    return np.array(places), np.array(areas)
