"""Write all scenes with the writers of other programs: `python writers.py FOLDER`, which takes two minutes.

FOLDER/asked.json says for each file who wrote it, what is asked, and the sides that a reader has to find. The packages
are gmsh, netgen-mesher, meshio, meshlane, pyvista, KratosMultiphysics, salome-med and exodus-helper; cgx is CalculiX'.
"""

import gzip
import json
import subprocess
import sys
from itertools import product
from pathlib import Path

import numpy as np
from scenes import NAMES, Scene, scenes

NUMBERS, BY_ID, BY_TAG = (("1", "2"), *((f"{key}=1", f"{key}=2") for key in ("MaterialIDs", "facet_tags")))
FOLDER, ASKED = Path(sys.argv[1]).absolute(), []
GMSH = {".msh", ".inp", ".med", ".unv", ".bdf", ".su2", ".mesh", ".vtk", ".key", ".stl", ".ply2", ".cgns", ".diff"}
MESHIO = {  # {ending: (format, the data in which it keeps numbers, what is asked)}
    ".v22.msh": ("gmsh22", "gmsh:physical", NAMES),
    ".v41.msh": ("gmsh", "gmsh:physical", NAMES),
    ".inp": ("abaqus", "", NAMES),
    ".vtu": ("vtu", "facet_tags", BY_TAG),
    ".vtk": ("vtk", "MaterialIDs", BY_ID),
    ".xdmf": ("xdmf", "facet_tags", BY_TAG),
    ".med": ("med", "", NAMES),
    ".mesh": ("medit", "medit:ref", NUMBERS),
    ".bdf": ("nastran", "nastran:ref", NUMBERS),
    ".avs": ("avsucd", "avsucd:material", NUMBERS),
    ".e": ("exodus", "", ("0", "1")),
}


def ask(scene: Scene, writer: str, file: str, slave: str, master: str) -> None:
    """Note a file; without one, slave and master are files."""
    ASKED.append({"file": file, "writer": writer, "asked": (slave, master), "truth": scene.truth()})


def by_gmsh(scene: Scene, name: str) -> None:
    import gmsh

    gmsh.initialize()
    kinds = {"line": 1, "triangle": 2, "quad": 3, "tetra": 4, "hexahedron": 5}
    for group, number, kind, nodes in scene.parts[::-1]:
        dim = scene.dim - (group in NAMES)
        gmsh.model.addDiscreteEntity(dim, number)
        if dim == scene.dim:
            used = np.unique(nodes)
            gmsh.model.mesh.addNodes(dim, number, used + 1, scene.points[used].reshape(-1))
        gmsh.model.mesh.addElementsByType(number, kinds[kind], [], nodes.reshape(-1) + 1)
        gmsh.model.addPhysicalGroup(dim, [number], number, group)
    gmsh.option.setNumber("Mesh.SaveGroupsOfElements", 1)
    versions = [(f"-{version}-{binary}.msh", version, binary) for version in (2.2, 4.1) for binary in (0, 1)] + [
        ("-4.0.msh", 4.0, 0)
    ]
    for ending, version, binary in [*versions, *((ending, 4.1, 0) for ending in sorted(GMSH))]:
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(str(FOLDER / f"gmsh-{name}{ending}"))
        names = {".bdf": NUMBERS, ".mesh": NUMBERS, ".vtk": ("CellEntityIds=1", "CellEntityIds=2")}.get(ending, NAMES)
        ask(scene, "Gmsh", f"gmsh-{name}{ending}", *names)
    (FOLDER / f"gmsh-{name}.msh.gz").write_bytes(gzip.compress((FOLDER / f"gmsh-{name}.msh").read_bytes()))
    ask(scene, "Gmsh", f"gmsh-{name}.msh.gz", *NAMES)


def by_netgen(scene: Scene, name: str) -> None:
    from netgen import meshing

    mesh = meshing.Mesh(scene.dim)
    points = [mesh.Add(meshing.MeshPoint(meshing.Pnt(*point))) for point in scene.points]
    for group, number, _, nodes in scene.parts:
        is_side = group in NAMES
        index = number if is_side else number - 2
        if is_side == (scene.dim == 3):
            mesh.Add(meshing.FaceDescriptor(surfnr=index, domin=index, domout=0, bc=index))
        for row in nodes:
            corners = [points[node] for node in row]
            if scene.dim - is_side == 1:
                mesh.Add(meshing.Element1D(corners, index=index))
            else:
                mesh.Add((meshing.Element2D if scene.dim - is_side == 2 else meshing.Element3D)(index, corners))
        (mesh.SetBCName if is_side else mesh.SetMaterial)(index - is_side, group)
    mesh.Save(str(FOLDER / f"netgen-{name}.vol"))
    ask(scene, "Netgen", f"netgen-{name}.vol", *NAMES)
    mesh.Export(str(FOLDER / f"netgen-{name}.msh"), "Gmsh2 Format")
    ask(scene, "Netgen", f"netgen-{name}.msh", *NUMBERS)


def by_meshio(scene: Scene, name: str) -> None:
    import meshio
    import meshlane

    entities = np.full((len(scene.points), 2), (scene.dim, 3))
    for group, number, _, nodes in scene.parts[::-1]:
        entities[nodes.reshape(-1)] = (scene.dim - (group in NAMES), number)
    for library, (ending, (format_, key, names)) in product((meshio, meshlane), MESHIO.items()):
        is_gmsh = format_.startswith("gmsh")
        ones = [[part] for part in scene.parts]
        # Most formats have one block of each kind.
        blocks = ones if is_gmsh or format_ == "exodus" else [ones[0] + ones[1], ones[2] + ones[3]]
        tags = [np.concatenate([np.full(len(nodes), number) for _, number, _, nodes in block]) for block in blocks]
        mesh = library.Mesh(
            scene.points,
            [(block[0][2], np.vstack([part[3] for part in block])) for block in blocks],
            point_data={"gmsh:dim_tags": entities} if format_ == "gmsh" else {},
            cell_data={each: tags for each in (key, "gmsh:geometrical" if is_gmsh else "") if each},
            cell_sets={}
            if key
            else {part[0]: [np.flatnonzero(tag == part[1]) for tag in tags] for part in scene.parts},
            field_data={n: np.array([k, scene.dim - (k < 3)]) for n, k, *_ in scene.parts} if is_gmsh else {},
        )
        library.write(FOLDER / f"{library.__name__}-{name}{ending}", mesh, file_format=format_)
        ask(scene, library.__name__, f"{library.__name__}-{name}{ending}", *names)


def by_pyvista(scene: Scene, name: str) -> None:
    import pyvista

    types = {"line": 3, "triangle": 5, "quad": 9, "tetra": 10, "hexahedron": 12}
    cells = np.concatenate([np.insert(nodes, 0, nodes.shape[1], axis=1).reshape(-1) for *_, nodes in scene.parts])
    kinds = np.concatenate([np.full(len(nodes), types[kind]) for *_, kind, nodes in scene.parts])
    grid = pyvista.UnstructuredGrid(cells, kinds, scene.points)
    grid.cell_data["MaterialIDs"] = np.concatenate([np.full(len(nodes), n, np.int32) for _, n, _, nodes in scene.parts])
    for ending, binary in product((".vtu", ".vtk"), (False, True)):
        grid.save(FOLDER / f"pyvista-{name}-{binary}{ending}", binary=binary)
        ask(scene, "PyVista", f"pyvista-{name}-{binary}{ending}", *BY_ID)
    for ending in (".ply", ".obj", ".stl")[: {"line": 0, "triangle": 3, "quad": 2}[scene.side_kind]]:
        files = [f"pyvista-{name}-{group}{ending}" for group in NAMES]
        for file, (*_, nodes) in zip(files, scene.parts, strict=False):
            used, faces = np.unique(nodes, return_inverse=True)
            faces = np.insert(faces.reshape(nodes.shape), 0, nodes.shape[1], axis=1)
            pyvista.PolyData(scene.points[used], faces.reshape(-1)).save(FOLDER / file)
        ask(scene, "PyVista", "", *files)


def by_kratos(scene: Scene, name: str) -> None:
    import KratosMultiphysics as Kratos

    part, count = Kratos.Model().CreateModelPart("Main"), 0
    part.AddProperties(Kratos.Properties(1))
    for number, point in enumerate(scene.points, 1):
        part.CreateNewNode(number, *map(float, point))
    for group, _, kind, nodes in scene.parts:
        sub, end = part.CreateSubModelPart(group), f"{scene.dim}D{nodes.shape[1]}N"
        sub.AddNodes((np.unique(nodes) + 1).tolist())
        condition = ("Line" if kind == "line" else "Surface") + "Condition" + end
        for row in (nodes + 1).tolist():
            count += 1
            create = sub.CreateNewCondition if group in NAMES else sub.CreateNewElement
            create(condition if group in NAMES else f"Element{end}", count, row, part.GetProperties()[1])
    Kratos.ModelPartIO(str(FOLDER / f"kratos-{name}"), Kratos.IO.WRITE).WriteModelPart(part)
    ask(scene, "Kratos", f"kratos-{name}.mdpa", *NAMES)


def by_med(scene: Scene, name: str) -> None:
    from med import medenum, medfamily, medfile, medmesh

    fid, (mesh, dim) = medfile.MEDfileOpen(str(FOLDER / f"med-{name}.med"), medenum.MED_ACC_CREAT), ("scene", scene.dim)
    axes = "".join(f"{axis:16s}" for axis in "xyz"[:dim]), " " * 16 * dim
    form = medenum.MED_UNSTRUCTURED_MESH, "", "", medenum.MED_SORT_DTIT, medenum.MED_CARTESIAN
    medmesh.MEDmeshCr(fid, mesh, dim, dim, *form, *axes)
    where = fid, mesh, medenum.MED_NO_DT, medenum.MED_NO_IT
    places = medfile.MEDFLOAT(scene.points[:, :dim].reshape(-1).tolist())
    medmesh.MEDmeshNodeCoordinateWr(*where, 0.0, medenum.MED_FULL_INTERLACE, len(scene.points), places)
    medfamily.MEDfamilyCr(fid, mesh, "FAMILLE_ZERO", 0, 0, medfamily.MEDCHAR(""))
    types = {"line": "SEG2", "triangle": "TRIA3", "quad": "QUAD4", "tetra": "TETRA4", "hexahedron": "HEXA8"}
    for first in (0, 2):
        parts, type_ = scene.parts[first : first + 2], getattr(medenum, f"MED_{types[scene.parts[first][2]]}")
        for group, number, *_ in parts:
            medfamily.MEDfamilyCr(fid, mesh, f"FAM_{group}", -number, 1, medfamily.MEDCHAR(f"{group:80s}"))
        rows = np.vstack([nodes for *_, nodes in parts]) + 1
        turned = {"tetra": [0, 2, 1, 3], "hexahedron": [0, 3, 2, 1, 4, 7, 6, 5]}.get(parts[0][2])  # As MED has them
        rows = rows[:, turned] if turned else rows
        data = len(rows), medfile.MEDINT(rows.reshape(-1).tolist())
        form = medenum.MED_CELL, type_, medenum.MED_NODAL, medenum.MED_FULL_INTERLACE
        medmesh.MEDmeshElementConnectivityWr(*where, 0.0, *form, *data)
        families = medfile.MEDINT(np.concatenate([np.full(len(nodes), -n) for _, n, _, nodes in parts]).tolist())
        medmesh.MEDmeshEntityFamilyNumberWr(*where, medenum.MED_CELL, type_, len(rows), families)
    medfile.MEDfileClose(fid)
    ask(scene, "MED-file", f"med-{name}.med", *NAMES)


def by_cgx(scene: Scene, name: str) -> None:
    if scene.kind == "tetra":  # Its command `elem` makes none.
        return
    commands = [f"node {n} {' '.join(f'{x:.9g}' for x in point)}" for n, point in enumerate(scene.points, 1)]
    rows = np.vstack([nodes for *_, nodes in scene.parts[2:]]) + 1
    kind = {"triangle": "tr3", "quad": "qu4", "tetra": "te4", "hexahedron": "he8"}[scene.kind]
    commands += [f"elem {number} {' '.join(map(str, row))} {kind}" for number, row in enumerate(rows, 1)]
    sets = ["read all.msh inp"]  # cgx knows the faces of elements that it reads.
    for group, *_, nodes in scene.parts[:2]:
        sets += [f"seta {group} n {node + 1}" for node in np.unique(nodes)]
        sets += [f"comp {group} do", f"send {group} abq nam", f"send {group} abq sur"]
    (FOLDER / f"cgx-{name}").mkdir(exist_ok=True)
    for each in ([*commands, "send all abq"], sets):
        (FOLDER / f"cgx-{name}" / "make.fbd").write_text("\n".join([*each, "quit"]) + "\n")
        subprocess.run(["cgx", "-bg", "make.fbd"], cwd=FOLDER / f"cgx-{name}", capture_output=True, check=False)
    deck = "".join(f"*INCLUDE, INPUT={file}\n" for file in ("all.msh", "punch.nam", "base.nam"))
    (FOLDER / f"cgx-{name}" / "nodes.inp").write_text(deck)
    deck += "".join(f"*SURFACE, NAME=S{group}\n*INCLUDE, INPUT={group}.sur\n" for group in NAMES)
    (FOLDER / f"cgx-{name}" / "pair.inp").write_text(f"{deck}*CONTACT PAIR, INTERACTION=hard\nSpunch, Sbase\n")
    ask(scene, "cgx", f"cgx-{name}/nodes.inp", "Npunch", "Nbase")
    ask(scene, "cgx", f"cgx-{name}/pair.inp", "", "")


def by_exodus_helper(scene: Scene, name: str) -> None:
    from exodus_helper import Exodus

    type_ = {"triangle": "TRISHELL3", "quad": "QUAD4", "tetra": "TET4", "hexahedron": "HEX8"}[scene.kind]
    (FOLDER / f"exodus-helper-{name}.e").unlink(missing_ok=True)
    n_first, counts = len(scene.parts[2][3]), {"num_nodes": len(scene.points), "num_el_blk": 2, "num_side_sets": 2}
    n_cells = n_first + len(scene.parts[3][3])
    mesh = Exodus(str(FOLDER / f"exodus-helper-{name}.e"), mode="w", num_elem=n_cells, **counts)
    mesh.put_coords(*scene.points.T)
    for number, (group, owners, (*_, cells)) in enumerate(zip(NAMES, scene.owners, scene.parts[2:], strict=True), 1):
        mesh.put_elem_blk_info(number, type_, len(cells), cells.shape[1], 0)
        mesh.put_elem_connectivity(number, (cells + 1).reshape(-1))
        mesh.put_side_set_params(number, len(owners))
        # The first two sides of a shell are its faces.
        mesh.put_side_set(number, owners[:, 0] + 1 + n_first * (number - 1), owners[:, 1] + 1 + 2 * (type_[3:4] == "S"))
        mesh.put_side_set_name(number, group)
    mesh.close()
    ask(scene, "exodus-helper", f"exodus-helper-{name}.e", *NAMES)


WRITERS = [by_gmsh, by_netgen, by_meshio, by_pyvista, by_kratos, by_med, by_cgx, by_exodus_helper]

if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    if len(sys.argv) == 4:  # One writer in a process of its own: each library brings its own HDF5.
        next(write for write in WRITERS if write.__name__ == sys.argv[2])(scenes()[sys.argv[3]], sys.argv[3])
        (FOLDER / "asked.json").write_text(json.dumps(ASKED))
        sys.exit()
    for writer, each in product(WRITERS, scenes()):
        command = [sys.executable, __file__, str(FOLDER), writer.__name__, each]
        ending = subprocess.run(command, capture_output=True, text=True, check=False)
        print(writer.__name__, each, ending.stderr[-300:] if ending.returncode else "")
        ASKED += json.loads((FOLDER / "asked.json").read_text()) if not ending.returncode else []
    (FOLDER / "asked.json").write_text(json.dumps(ASKED))
