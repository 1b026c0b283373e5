"""Settings of Jupyter's server for the apps, of which Binder runs one for each visitor."""

c = get_config()  # noqa: F821

# Jupyter drops what exceeds its defaults, 10 MB a message and 1 MB a second, without a word.
c.ServerApp.tornado_settings = {"websocket_max_message_size": 64 * 1024 * 1024}
c.ZMQChannelsWebsocketConnection.iopub_data_rate_limit = 1e9

# A kernel without a page is ended after two minutes: another one finds the session where it was.
c.MappingKernelManager.cull_idle_timeout = 120
c.MappingKernelManager.cull_interval = 30

# The loading screen is heartgen's own.
c.VoilaConfiguration.template = "heartgen"
