# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The dots of one picture, each with its row and its column."""
import cv2

from tactile_perception import detect_dots, index_dots

ROWS, COLUMNS = 9, 13
image = cv2.imread('docs/examples/sheet.jpg')
dots = detect_dots(image, polarity='bright')
grid = index_dots(dots.uv, ROWS, COLUMNS)
print(f'{len(dots)} dots, median standard error {sorted(dots.sigma)[len(dots) // 2]:.3f} px')
for (u, v), id in zip(dots.uv, grid.id):
    if id < 0:  # its position in the grid is uncertain
        continue
    row, column = divmod(int(id), COLUMNS)
    cv2.circle(image, (round(u), round(v)), 14, (0, 255, 255), 1, cv2.LINE_AA)
    cv2.putText(image, f'{row}.{column}', (round(u) - 12, round(v) + 4), cv2.FONT_HERSHEY_SIMPLEX, 0.35, (255, 255, 255), 1, cv2.LINE_AA)
    if column == 0:
        print(f'row {row}: first dot at u {u:.2f} px, v {v:.2f} px')
cv2.imwrite('rows_and_columns.png', image)
