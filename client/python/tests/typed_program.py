"""A program as users write them: mypy checks it against the types of the package (test_source.py)."""

import numpy as np
import relmap
import relmap.aio


def use(client: relmap.Client) -> float:
    session = client.sessions().named("morning")
    for edge in client.edges(session=session, states=["accepted"], kinds="loop", order="suspicion")[:5]:
        print(client.explain_edge(edge).edge.suspicion, client.frame(edge.a).labels)
    client.localise("2:8")
    client.localise(np.zeros((384, 512), np.uint8), camera=session)
    client.export_trajectories("tum", session)
    first: relmap.EdgeId = client.edges()[0].id
    place = client.localise("left.png", camera=relmap.StereoCamera(400, 256, 192, 0.1, 512, 384))
    route = client.find_route(place.frame, relmap.Label("kitchen"))
    edges = client.edges(order=relmap.EdgeOrder.SUSPICION)
    worst = edges[0].suspicion.value if edges and edges[0].suspicion else 0.0
    for event in client.watch():
        print(event.origin.author)
        break
    print(first)
    return float(np.linalg.norm(place.T[:3, 3])) + route.length_m + worst


async def use_aio() -> None:
    async with await relmap.aio.connect("map") as client:
        async for edge in client.iter_edges():
            print(edge.id)
        async with client.session("cart", relmap.StereoCamera(400, 256, 192, 0.1, 512, 384)) as session:
            await session.add(0, np.eye(4), source="vision")
            await session.flush()
