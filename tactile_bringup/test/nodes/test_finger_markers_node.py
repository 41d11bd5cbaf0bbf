# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""finger_markers_node draws for those who look, and nothing for nobody."""
import numpy as np
from geometry_msgs.msg import Vector3
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import Image
from tactile_bringup.nodes.finger_markers_node import FingerMarkersNode, finger_picture
from tactile_driver.nodes.messages.images import image_to_array
from tactile_msgs.msg import Contact, Contacts
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray


def test_markers_for_somebody_and_the_tip_for_all(bench):
    other, until = bench(FingerMarkersNode)
    contacts = other.create_publisher(Contacts, 'contacts', 10)
    places, drawn = [], []
    other.create_subscription(TFMessage, '/tf_static', places.append, QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    assert until(lambda: places)
    tip = places[0].transforms[0]
    assert (tip.header.frame_id, tip.child_frame_id, tip.transform.translation.z) == ('psd_finger', 'psd_finger_tip', 0.016)
    assert contacts.get_subscription_count() == 0
    other.create_subscription(MarkerArray, 'markers', drawn.append, 10)
    assert until(lambda: contacts.get_subscription_count() == 1)
    message = Contacts()
    message.header.frame_id, message.header.stamp.sec = 'psd_finger', 7
    contacts.publish(message)
    assert until(lambda: drawn)
    assert drawn[0].markers[1].ns == 'finger' and drawn[0].markers[1].header.stamp.sec == 7


def test_the_annotated_image_shows_contacts_and_force_to_those_who_look(bench):
    other, until = bench(FingerMarkersNode)
    contacts, drawn = other.create_publisher(Contacts, 'contacts', 10), []
    other.create_subscription(Image, 'image_annotated', drawn.append, 10)
    assert until(lambda: contacts.get_subscription_count() == 1)
    message = Contacts(contacts=[Contact(normal=Vector3(x=0.5, z=0.87), force=1.2), Contact(normal=Vector3(x=-0.5, z=0.87), force=np.nan)])
    message.header.frame_id, message.header.stamp.sec = 'psd_finger', 7
    contacts.publish(message)
    assert until(lambda: drawn)
    assert np.array_equal(image_to_array(drawn[0]), finger_picture(message))
    assert (drawn[0].header.frame_id, drawn[0].header.stamp.sec) == ('psd_finger', 7)
