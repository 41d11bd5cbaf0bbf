# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest
import yaml
from tactile_bringup.visualization.rviz import page as rviz_page
from tactile_bringup.visualization.rviz.camera_view import OrbitView


@pytest.mark.parametrize(('least', 'size'), [(0.0045, 0.005), (0.005, 0.005), (0.0051, 0.01), (0.036, 0.05), (0.011, 0.02)])
def test_cells_of_a_grid_are_round_numbers(least, size):
    assert rviz_page.cell_size(least) == size


def test_many_pictures_share_three_panels_in_tabs():
    pictures = [rviz_page.image(f'p{k}', f'/p{k}/image_annotated') for k in range(5)]
    page = yaml.safe_load(rviz_page.page(pictures, 'hand', OrbitView(0.5, (0.0, 0.0, 0.1))))
    state = page['Window Geometry']['QMainWindow State']
    order = [state.index(f'p{k}'.encode('utf-16-be').hex()) for k in (0, 3, 1, 4, 2)]
    assert order == sorted(order) and state.count('fa0000000002') == 2
    assert page['Visualization Manager']['Views']['Current']['Distance'] == 0.5
    assert rviz_page.room(5)[0] == rviz_page.room(0)[0] - 600


def test_every_namespace_has_a_checkbox():
    assert rviz_page.markers('Touch', '/pad/markers', ('skin', 'dots'))['Namespaces'] == {'skin': True, 'dots': True}


def test_a_cloud_is_coloured_within_its_limits_and_off():
    cloud = rviz_page.cloud('Points', '/pad/points', 0.00123456, 'normal_force', (0.0, 0.05))
    assert (cloud['Size (m)'], cloud['Min Intensity'], cloud['Max Intensity']) == (0.00123, 0.0, 0.05)
    assert not cloud['Enabled'] and not cloud['Value'] and not cloud['Autocompute Intensity Bounds']
