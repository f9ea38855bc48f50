"""What asyncio adds: many calls at once, and calls that are given up."""

from __future__ import annotations

import asyncio

import numpy as np
import pytest
from servers import Server

import wade
import wade.aio


def test_calls_run_beside_each_other(server: Server) -> None:
    depths = np.linspace(0.05, 0.2, 30)

    async def main() -> list[wade.Forces]:
        async with wade.aio.GrpcClient(server.address, timeout_s=20.0) as client:
            return await asyncio.gather(*(client.evaluate("husky", wade.State(depth_m=depth)) for depth in depths))

    with wade.GrpcClient(server.address, timeout_s=20.0) as client:
        alone = [client.evaluate("husky", wade.State(depth_m=depth)).force_n[2] for depth in depths]
    assert [forces.force_n[2] for forces in asyncio.run(main())] == alone


def test_a_call_that_is_given_up_leaves_the_client_whole(mortal_server: Server) -> None:
    mortal_server.start()
    state = wade.State(depth_m=0.15)

    async def main() -> None:
        async with (
            wade.aio.GrpcClient(mortal_server.address, timeout_s=20.0) as client,
            client.stream("husky") as stream,
        ):
            expected = await stream.evaluate(state)
            mortal_server.freeze()
            for call in (stream.evaluate, lambda s: client.evaluate("husky", s)):
                task = asyncio.create_task(call(wade.State(depth_m=0.05)))
                await asyncio.sleep(0.1)
                task.cancel()
                with pytest.raises(asyncio.CancelledError):
                    await task
            mortal_server.thaw()
            for forces in (await stream.evaluate(state), await client.evaluate("husky", state)):
                np.testing.assert_array_equal(forces.force_n, expected.force_n)

    asyncio.run(main())
