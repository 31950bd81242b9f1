class Recordings:
    pass


class Scenarios:
    pass
