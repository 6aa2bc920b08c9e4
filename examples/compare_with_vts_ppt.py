"""Put a formulation beside VTS-PPT, property by property, on the same random cases.

On the command line this is `contactverif compare vts-me mortar --against vts-ppt`, with errors and times as well.
"""

from contactverif import verify

names = ["vts-ppt", "vts-me", "mortar"]
properties = ["patch.flat.transmission", "patch.dead-zone", "balance.*", "tangent.*"]
result = verify(names, properties, examples=20, seed=1)
verdicts = {(row.formulation, row.property_id): str(row.verdict) for row in result.rows}
property_ids = sorted({property_id for _, property_id in verdicts})

print(f"{'property':26}" + "".join(f"{name:10}" for name in names))
for property_id in property_ids:
    print(f"{property_id:26}" + "".join(f"{verdicts[name, property_id]:10}" for name in names))

better = [id_ for id_ in property_ids if (verdicts["vts-ppt", id_], verdicts["mortar", id_]) == ("fail", "pass")]
print("mortar passes where VTS-PPT fails:", ", ".join(better))
