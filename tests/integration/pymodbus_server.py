"""An independent Modbus server: pymodbus with known counts, and the requests it saw.

usage: pymodbus_server.py PORT|SERIAL-LINE. Prints 'ready', then serves and prints each write to the voltage register.
"""
import asyncio
import sys

from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
from pymodbus.framer.rtu_framer import ModbusRtuFramer
from pymodbus.server import StartAsyncSerialServer, StartAsyncTcpServer

CART, PENDULUM = -123456, 70001  # as the test expects them


def words(value):
    value &= 0xFFFFFFFF
    return [value >> 16, value & 0xFFFF]


class Registers(ModbusSequentialDataBlock):
    """Says each write to the voltage register on stdout."""

    def setValues(self, address, values):
        super().setValues(address, values)
        if address == 16:
            print("voltage", values[0] if isinstance(values, list) else values, flush=True)


async def main(line):
    holding = Registers(0, words(CART) + words(PENDULUM) + [7] + [0] * 60)
    inputs = ModbusSequentialDataBlock(0, words(CART) + words(PENDULUM) + [7] + [0] * 60)
    context = ModbusServerContext(ModbusSlaveContext(hr=holding, ir=inputs, zero_mode=True), single=True)

    async def say_ready():
        await asyncio.sleep(0.3)
        print("ready", flush=True)

    asyncio.get_running_loop().create_task(say_ready())
    if line.isdigit():
        await StartAsyncTcpServer(context, address=("127.0.0.1", int(line)))
    else:
        await StartAsyncSerialServer(context, framer=ModbusRtuFramer, port=line, baudrate=115200)


asyncio.run(main(sys.argv[1]))
