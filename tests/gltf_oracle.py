"""The glTF skinning equation on what an independent library (pygltflib) reads."""

import numpy as np
import pygltflib
from scipy.spatial.transform import Rotation

KINDS = {5121: "u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}


def numbers(gltf, index):
    """An accessor's numbers (tightly packed), (N, width)."""
    accessor = gltf.accessors[index]
    view = gltf.bufferViews[accessor.bufferView]
    start = view.byteOffset + (accessor.byteOffset or 0)
    width = WIDTHS[accessor.type]
    blob = gltf.binary_blob()
    kind = KINDS[accessor.componentType]
    flat = np.frombuffer(blob, kind, accessor.count * width, start)
    return flat.reshape(accessor.count, width)


class Scene:
    """A file that can be asked where its skins are at a time."""

    def __init__(self, path):
        self.gltf = pygltflib.GLTF2().load(str(path))

    @property
    def skinned(self):
        """Nodes with a skin."""
        return [n for n in self.gltf.nodes if n.skin is not None]

    def world(self, time):
        """World matrices of all nodes, animated to a time."""
        nodes = self.gltf.nodes
        parts = [
            {
                "translation": np.array(node.translation or [0.0, 0.0, 0.0]),
                "rotation": np.array(node.rotation or [0.0, 0.0, 0.0, 1.0]),
            }
            for node in nodes
        ]
        for animation in self.gltf.animations:
            for channel in animation.channels:
                sampler = animation.samplers[channel.sampler]
                times = numbers(self.gltf, sampler.input)[:, 0]
                key = int(np.argmin(np.abs(times - time)))
                values = numbers(self.gltf, sampler.output)
                parts[channel.target.node][channel.target.path] = values[key]
        out = [None] * len(nodes)

        def visit(index, above):
            own = np.eye(4)
            turn = Rotation.from_quat(parts[index]["rotation"]).as_matrix()
            own[:3, :3], own[:3, 3] = turn, parts[index]["translation"]
            out[index] = above @ own
            for child in nodes[index].children or []:
                visit(child, out[index])

        for index in self.gltf.scenes[self.gltf.scene].nodes:
            visit(index, np.eye(4))
        return out

    def vertices(self, node, time):
        """(V, 3) where a skinned node's vertices are at a time."""
        world, skin = self.world(time), self.gltf.skins[node.skin]
        inverse = numbers(self.gltf, skin.inverseBindMatrices).astype(float)
        inverse = inverse.reshape(-1, 4, 4).transpose(0, 2, 1)
        moved = np.array(
            [world[j] @ b for j, b in zip(skin.joints, inverse, strict=True)]
        )
        at = self.gltf.meshes[node.mesh].primitives[0].attributes
        places = numbers(self.gltf, at.POSITION).astype(float)
        homogeneous = np.column_stack([places, np.ones(len(places))])
        joints, weights = (
            numbers(self.gltf, at.JOINTS_0),
            numbers(self.gltf, at.WEIGHTS_0),
        )
        mean = np.einsum("vk,vkij->vij", weights.astype(float), moved[joints])
        return np.einsum("vij,vj->vi", mean, homogeneous)[:, :3]
